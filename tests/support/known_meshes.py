"""Volume meshes whose answers are known, built by formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from parameterize.meshes.kinds import SERENDIPITY, ElementKind, hexahedron, tetra
from parameterize.meshes.mesh import Block, VolumeMesh

HEX8, HEX27, HEX64, TET4, TET10, TET20 = hexahedron(1), hexahedron(2), hexahedron(3), tetra(1), tetra(2), tetra(3)
HEX20 = SERENDIPITY
KINDS = [HEX8, HEX20, HEX27, HEX64, TET4, TET10, TET20]

Map = Callable[[np.ndarray], np.ndarray]


def bent(x):
    """A quadratic map of the unit cube, exact in elements of degree 2."""
    u, v, w = x.T
    return np.stack([u + 0.2 * v * v, v + 0.1 * w * u, w + 0.15 * u * u - 0.1 * v], axis=1)


def lattice_cells(kind: ElementKind, counts) -> tuple[np.ndarray, np.ndarray]:
    """Return places (n, 3) in elements, and the nodes (k, nodes) of a grid; each cube of tetrahedra is cut into six."""
    p, counts = np.array(kind.degrees), np.array(counts)
    shape = p * counts + 1
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    local = [kind.lattice] if kind.shape == "hexahedron" else list(map(np.array, _six(kind)))
    rows = np.concatenate([cells[:, None] * p + own for own in local])
    return places / p, np.ravel_multi_index(tuple(np.moveaxis(rows, -1, 0)), tuple(shape))


def _six(kind):
    weights = np.column_stack([kind.degrees[0] - kind.lattice.sum(axis=1), kind.lattice])
    for way in permutations(range(3)):
        corners = np.cumsum([np.zeros(3, dtype=int), *np.eye(3, dtype=int)[list(way)]], axis=0)
        if np.linalg.det(corners[1:]) < 0:
            corners[[1, 2]] = corners[[2, 1]]
        yield weights @ corners


def grid(kind: ElementKind, counts=(2, 2, 2), shape: Map = lambda x: x, wrap: int = 0) -> VolumeMesh:
    """Return a grid of elements, the unit cube through a map. wrap: > 0 glues the last layer along u to the first."""
    places, nodes = lattice_cells(kind, counts)
    points = shape(places / np.array(counts))
    if wrap:
        plane = len(points) // (kind.degrees[0] * counts[0] + 1)
        nodes = nodes % (plane * kind.degrees[0] * counts[0])
    return VolumeMesh(points, (Block(kind, nodes, 1 + np.arange(len(nodes))),))


def together(*meshes: VolumeMesh) -> VolumeMesh:
    """Return meshes as one, with nodes of their own; elements are numbered on."""
    points, blocks, nodes, elements = [], [], 0, 0
    for mesh in meshes:
        points.append(mesh.points)
        for block in mesh.blocks:
            blocks.append(Block(block.kind, block.nodes + nodes, elements + 1 + np.arange(len(block.nodes))))
            elements += len(block.nodes)
        nodes += len(mesh.points)
    return VolumeMesh(np.concatenate(points), tuple(blocks))


def moved(mesh: VolumeMesh, step=(0, 0, 0), scale=1.0) -> VolumeMesh:
    return VolumeMesh(mesh.points * scale + np.array(step), mesh.blocks, mesh.unchecked)


def one(kind: ElementKind, changes=(), nodes=None) -> VolumeMesh:
    """Return one element, straight but for some nodes: pairs of a place in the lattice and a point."""
    points = kind.lattice / np.array(kind.degrees) if nodes is None else np.array(nodes, dtype=float)
    for place, point in changes:
        points[np.flatnonzero((kind.lattice == place).all(axis=1))[0]] = point
    return VolumeMesh(points, (Block(kind, np.arange(len(points))[None], np.array([7])),))


def with_nodes(mesh: VolumeMesh, more) -> VolumeMesh:
    """Return a mesh of one kind with further elements of the nodes it has."""
    (block,) = mesh.blocks
    rows = np.concatenate([block.nodes, np.array(more)])
    return VolumeMesh(mesh.points, (Block(block.kind, rows, 1 + np.arange(len(rows))),))


def mirrored(kind: ElementKind, row) -> np.ndarray:
    """Return the nodes of an element in the order that turns it inside out: two directions change places."""
    order = [np.flatnonzero((kind.lattice == place[[1, 0, 2]]).all(axis=1))[0] for place in kind.lattice]
    return np.array(row)[order]


def one_inverted(kind: ElementKind) -> VolumeMesh:
    mesh = grid(kind)
    nodes = mesh.blocks[0].nodes.copy()
    nodes[3] = mirrored(kind, nodes[3])
    return VolumeMesh(mesh.points, (Block(kind, nodes, 1 + np.arange(len(nodes))),))


def ring(turns: float, rise: float = 0.0) -> Map:
    """A ring around the z axis; u leads around it."""

    def shape(x):
        angle, radius = 2.0 * np.pi * turns * x[:, 0], 2.0 - x[:, 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), x[:, 2] + rise * x[:, 0]], axis=1)

    return shape


def _box(low, high, counts=(1, 1, 1), kind=HEX8):
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    return grid(kind, counts, lambda x: low + x * (high - low))


def hollow() -> VolumeMesh:
    """Twenty-six of the twenty-seven cubes of a larger one."""
    mesh = grid(HEX8, (3, 3, 3))
    rows = np.delete(mesh.blocks[0].nodes, 13, axis=0)
    return VolumeMesh(mesh.points, (Block(HEX8, rows, 1 + np.arange(26)),))


def corner_pair(shared: int) -> VolumeMesh:
    """Two cubes with one corner, or the two corners of an edge, in common."""
    cubes = grid(HEX8)
    rows = cubes.blocks[0].nodes
    return VolumeMesh(cubes.points, (Block(HEX8, rows[[0, 7 if shared == 1 else 6]], np.array([1, 2])),))


def chequered() -> VolumeMesh:
    """Every second cube of a grid: they touch along edges."""
    mesh = grid(HEX8, (3, 3, 3))
    rows = mesh.blocks[0].nodes[::2]
    return VolumeMesh(mesh.points, (Block(HEX8, rows, 1 + np.arange(len(rows))),))


def fanned() -> VolumeMesh:
    """A cube, and another element in its inside but for an edge that they have in common."""
    square = grid(HEX8, (1, 1, 1)).points
    at_edge = (square[:, :2] == 0).all(axis=1)
    inner = square @ np.array([[0.3, 0.1, 0], [0.1, 0.3, 0], [0, 0, 0.5]]) + [0, 0, 0.25]
    first = [int(np.flatnonzero((square == x).all(axis=1))[0]) for x in HEX8.lattice]
    second = [k if at_edge[k] else 8 + k for k in first]
    return VolumeMesh(np.concatenate([square, inner]), (Block(HEX8, np.array([first, second]), np.array([1, 2])),))


def back_over() -> VolumeMesh:
    """Two cubes with a face in common, the second folded back into the first, both right-handed."""
    points = grid(HEX8, (1, 1, 1)).points
    half = points * [1.0, 1.0, 0.5]
    number = {tuple(x): i for i, x in enumerate(points)}
    first = [number[tuple(x)] for x in HEX8.lattice / 1.0]
    bottom, top = first[:4], first[4:]
    second = [*bottom, *(8 + k for k in top)]
    return VolumeMesh(np.concatenate([points, half]), (Block(HEX8, np.array([first, second]), np.array([1, 2])),))


def unlike_sides() -> VolumeMesh:
    """A cube with nodes on its edges beside one without, the same corner nodes between them; the common face bulges."""
    quadratic, linear = grid(HEX20, (1, 1, 1)), _box((1, 0, 0), (2, 1, 1))
    mesh = together(quadratic, linear)
    labels = np.arange(len(mesh.points))
    for k in range(len(quadratic.points), len(labels)):
        here = np.flatnonzero((quadratic.points == mesh.points[k]).all(axis=1))
        labels[k] = here[0] if len(here) else k
    blocks = tuple(Block(block.kind, labels[block.nodes], block.numbers) for block in mesh.blocks)
    return VolumeMesh(mesh.points, blocks)


def with_wedges() -> VolumeMesh:
    mesh = grid(HEX8)
    return VolumeMesh(mesh.points, mesh.blocks, {"wedge": 4})


# Positive at its corners, and at all Gauss points of the rule with 2 x 2 x 2, yet folded inside.
TWISTED = [(3, 4, 0), (8, 0, 0), (4, 6, 0), (2, 4, 3), (1, 0, 5), (8, 0, 4), (5, 8, 4), (3, 6, 4)]


@dataclass(frozen=True)
class Known:
    """A mesh with its answers: the verdict on det J, whether elements overlap, and more where it is asked."""

    mesh: Callable[[], VolumeMesh]
    verdict: str
    overlap: bool | None = None
    left_handed: bool = False
    touching: int = 0
    worst: int | None = None
    hidden: bool = False  # det J is positive at all corners and Gauss points, of a rule of degree 3
    reason: str = field(default="")


KNOWN: dict[str, Known] = {
    **{f"grid of {kind}": Known(lambda kind=kind: grid(kind, (2, 3, 2)), "certified", False) for kind in KINDS},
    **{f"bent {kind}": Known(lambda kind=kind: grid(kind, (2, 2, 2), bent), "certified", False) for kind in KINDS},
    **{f"one of {kind} inverted": Known(lambda k=kind: one_inverted(k), "folded", worst=4) for kind in KINDS},
    **{
        f"left-handed {kind}": Known(
            lambda kind=kind: moved(grid(kind, (2, 2, 2), bent), scale=np.array([1, 1, -1.0])), "certified", False, True
        )
        for kind in (HEX8, HEX20, HEX64, TET10, TET20)
    },
    **{
        f"{kind} far from the origin": Known(
            lambda k=kind: moved(grid(k, (2, 2, 2), bent), (1e6, 2e6, -1e6)), "certified", False
        )
        for kind in (HEX27, TET10)
    },
    **{
        f"{kind} in tiny units": Known(lambda k=kind: moved(grid(k, (2, 2, 2), bent), scale=1e-6), "certified", False)
        for kind in (HEX20, TET20)
    },
    "hexahedron with a flat corner": Known(lambda: one(HEX8, [((1, 1, 1), (0.5, 0.5, 1.0))]), "flat", worst=7),
    "hexahedron with a corner pushed in": Known(lambda: one(HEX8, [((1, 1, 1), (0.3, 0.3, 0.3))]), "folded", worst=7),
    "wedge as a hexahedron": Known(lambda: one(HEX8, [((0, 1, 0), (0, 0, 0)), ((0, 1, 1), (0, 0, 1))]), "flat"),
    "tetrahedron in a plane": Known(lambda: one(TET4, [((0, 0, 1), (1, 1, 0))]), "flat"),
    "almost flat tetrahedron": Known(lambda: one(TET4, [((0, 0, 1), (1, 1, 1e-4))]), "certified", False),
    "twisted hexahedron": Known(lambda: one(HEX8, nodes=TWISTED), "folded", hidden=True),
    "centre of hexahedron27 too high": Known(
        lambda: one(HEX27, [((1, 1, 1), (0.5, 0.5, 0.78))]), "folded", hidden=True
    ),
    "centre of hexahedron27 less high": Known(lambda: one(HEX27, [((1, 1, 1), (0.5, 0.5, 0.7))]), "certified", False),
    "inner node of hexahedron64 astray": Known(lambda: one(HEX64, [((1, 1, 1), (0.33, 0.33, 0.75))]), "folded"),
    "quarter point in hexahedron20": Known(lambda: one(HEX20, [((1, 0, 0), (0.25, 0, 0))]), "flat"),
    "quarter point in tetra10": Known(lambda: one(TET10, [((1, 0, 0), (0.25, 0, 0))]), "flat"),
    "node of hexahedron20 too far": Known(lambda: one(HEX20, [((1, 0, 0), (0.24, 0, 0))]), "folded", worst=7),
    "node of tetra10 too far": Known(lambda: one(TET10, [((1, 0, 0), (0.24, 0, 0))]), "folded"),
    "node of tetra10 not too far": Known(lambda: one(TET10, [((1, 0, 0), (0.26, 0, 0))]), "certified", False),
    "nodes of tetra20 exchanged": Known(
        lambda: one(TET20, [((1, 0, 0), (2 / 3, 0, 0)), ((2, 0, 0), (1 / 3, 0, 0))]), "folded"
    ),
    "face of tetra20 pushed in": Known(lambda: one(TET20, [((1, 1, 0), (1 / 3, 1 / 3, 0.5))]), "folded"),
    "cubes touching at a node": Known(lambda: corner_pair(1), "certified", False),
    "cubes touching at an edge": Known(lambda: corner_pair(2), "certified", False),
    "a wedge of elements across another, at an edge": Known(fanned, "certified", True, reason="edge"),
    "voxels in a chequerboard": Known(chequered, "certified", False),
    "cubes touching, not glued": Known(
        lambda: together(_box((0, 0, 0), (1, 1, 1), (2, 2, 2)), _box((1, 0, 0), (2, 1, 1), (2, 2, 2))),
        "certified",
        False,
        touching=4,
    ),
    "cubes touching with other faces": Known(
        lambda: together(_box((0, 0, 0), (1, 1, 1)), _box((1, 0, 0), (2, 1, 1), (2, 2, 2))), "certified", reason="touch"
    ),
    "cubes a hair apart": Known(
        lambda: together(_box((0, 0, 0), (1, 1, 1)), _box((1 + 1e-6, 0, 0), (2, 1, 1))), "certified", False
    ),
    "cubes across each other": Known(
        lambda: together(_box((0, 0, 0), (1, 1, 1)), _box((0.5, 0.25, 0.25), (1.5, 1.3, 1.2))), "certified", True
    ),
    "tetrahedra across each other": Known(
        lambda: together(grid(TET10), moved(grid(TET10), (0.3, 0.4, 0.35))), "certified", True
    ),
    "an element given twice": Known(
        lambda: with_nodes(grid(HEX8), [grid(HEX8).blocks[0].nodes[5]]), "certified", True, reason="element"
    ),
    "the only element given twice": Known(lambda: with_nodes(one(TET10), [np.arange(10)]), "certified", True),
    "an element twice, with nodes of its own": Known(
        lambda: together(grid(HEX8), _box((0, 0, 0), (0.5, 0.5, 0.5))), "certified", True
    ),
    "an element folded back over another": Known(back_over, "certified", True, reason="same side"),
    "a ring": Known(lambda: grid(HEX20, (8, 1, 1), ring(1), wrap=1), "certified", False),
    "a ring, wound twice": Known(lambda: grid(HEX20, (16, 1, 1), ring(2)), "certified", True),
    "a ring, wound twice, closed": Known(lambda: grid(HEX8, (16, 1, 1), ring(2), wrap=1), "certified", True),
    "a helix that meets itself": Known(lambda: grid(HEX8, (24, 1, 1), ring(2, rise=0.7)), "certified", True),
    "a helix that does not": Known(lambda: grid(HEX8, (24, 1, 1), ring(2, rise=2.2)), "certified", False),
    "a cube inside of a cube": Known(
        lambda: together(_box((0, 0, 0), (3, 3, 3), (2, 2, 2)), _box((0.7, 0.7, 0.7), (0.9, 0.9, 0.9))),
        "certified",
        True,
    ),
    "a tetrahedron inside of tetrahedra": Known(
        lambda: together(grid(TET10), moved(one(TET4), (0.6, 0.6, 0.3), 0.1)), "certified", True
    ),
    "a hollow cube": Known(hollow, "certified", False),
    "a cube in a hollow cube": Known(
        lambda: together(hollow(), _box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6))), "certified", False
    ),
    "a cube in the hollow, without a gap": Known(
        lambda: together(hollow(), _box(*[(x, x, x) for x in (1 / 3, 2 / 3)])), "certified", False, touching=6
    ),
    "sides with other nodes": Known(unlike_sides, "certified", None, reason="conform"),
    "wedges beside hexahedra": Known(with_wedges, "undecided", False),
}
