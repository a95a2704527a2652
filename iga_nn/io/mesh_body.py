"""Makes a body of Bezier patches of a volume mesh: one of a hexahedron, four of a tetrahedron, exactly.

All patches have the largest degree of the mesh. Faces with the same nodes in the same places are glued. Elements of
different groups belong to different solids, with the groups' names.
"""

import logging

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.layouts.complex import Complex
from parameterize.meshes.faces import faces_of
from parameterize.meshes.kinds import ElementKind
from parameterize.meshes.mesh import Block, VolumeMesh
from parameterize.meshes.overlap import same_places
from parameterize.meshes.patches import PARTS, patch_matrices
from parameterize.spline.bernstein import elevation
from parameterize.spline.body import Body
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.solids import PatchSolids
from parameterize.spline.spline_map import ControlNets, SplineMap

log = logging.getLogger(__name__)

MOST = 20_000  # patches: beyond them a solve takes hours


def body_of_mesh(mesh: VolumeMesh) -> Body:
    """Return the body of a mesh's elements. Raises ValueError where these do not fit together."""
    if mesh.unchecked:
        held = ", ".join(f"{count} {kind}" for kind, count in mesh.unchecked.items())
        raise ValueError(f"holds {held}: a body is made of hexahedra and tetrahedra")
    count = sum(len(block.nodes) * (1 if block.kind.shape == "hexahedron" else len(PARTS)) for block in mesh.blocks)
    if count > MOST:
        raise ValueError(f"its {len(mesh)} elements are {count} patches, more than {MOST}: give a coarser mesh")
    labels = same_places(mesh.points)
    _demand_fitting(mesh, labels)
    degree = max(max(block.kind.degrees) for block in mesh.blocks)
    parts = [_patches(mesh, block, labels, degree) for block in mesh.blocks]
    nets = np.concatenate([net for net, _ in parts])  # (k, n, n, n, 3)
    vertices = _numbered(np.concatenate([corners for _, corners in parts]))
    knots = (open_uniform_knots(degree + 1, degree),) * 3
    interfaces = Complex(np.zeros((int(vertices.max()) + 1, 3)), vertices).interfaces
    control = ControlNets(degree, (knots,) * len(nets), interfaces, _solids(mesh))
    points = np.ascontiguousarray(np.moveaxis(nets, -1, 0)).reshape(3, -1)
    return SplineMap(control, control.merged(points)).body


def _demand_fitting(mesh: VolumeMesh, labels: IntArray) -> None:
    """Raise ValueError for elements with a node twice, and for faces that do not fit together."""
    for block in mesh.blocks:
        corners = np.sort(labels[block.nodes[:, : block.kind.corner_count]], axis=1)
        if len(twice := np.flatnonzero((corners[:, 1:] == corners[:, :-1]).any(axis=1))):
            raise ValueError(f"element {block.numbers[twice[0]]} has two corners in one place, and is no patch")
    faces = faces_of(mesh, labels)
    for rows, fault in (
        (faces.unlike, "has a face with the corner nodes of another one, but other nodes: save a conforming mesh"),
        (faces.crowded, "has a face that three or more elements have: remove the elements that are given twice"),
        (faces.one_sided, "lies on the same side of a face as another one: `iga-nn check` says more"),
    ):
        if len(rows):
            raise ValueError(f"element {mesh.numbers[faces.elements[rows[0]]]} {fault}")


def _patches(mesh: VolumeMesh, block: Block, labels: IntArray, degree: int) -> tuple[Array, IntArray]:
    """Return the control points (k, n, n, n, 3) of a block's patches, and keys (k, 2, 2, 2, 4) of their corners.

    A key has the labels of the nodes that the corner is the middle of, ascending, -1 before them.
    """
    u, v, w = (elevation(p, degree) for p in block.kind.degrees)
    matrices = np.einsum("ai,bj,ck,pijkn->pabcn", u, v, w, patch_matrices(block.kind), optimize=True)
    nets = np.einsum("pabcn,knx->kpabcx", matrices, mesh.points[block.nodes], optimize=True)
    nodes = labels[block.nodes]
    keys = np.full((len(nodes), len(matrices), 2, 2, 2, 4), -1)
    for part, place in np.ndindex(len(matrices), 8):
        corner = np.unravel_index(place, (2, 2, 2))
        own = np.sort(nodes[:, _corner_nodes(block.kind, part, tuple(map(int, corner)))], axis=1)
        keys[:, part, *corner, 4 - own.shape[1] :] = own
    return nets.reshape(-1, *nets.shape[2:]), keys.reshape(-1, 2, 2, 2, 4)


def _corner_nodes(kind: ElementKind, part: int, corner: tuple[int, ...]) -> list[int]:
    """Return the local numbers of the nodes that a corner of a patch is the middle of."""
    if kind.shape == "hexahedron":
        place = np.array(corner) * kind.degrees
        return [int(np.flatnonzero((kind.lattice == place).all(axis=1))[0])]
    own, *others = PARTS[part].tolist()
    return [own, *(other for other, step in zip(others, corner, strict=True) if step)]


def _numbered(keys: IntArray) -> IntArray:
    """Return numbers (k, 2, 2, 2) of the corners with keys (k, 2, 2, 2, 4)."""
    _, numbers = np.unique(keys.reshape(-1, 4), axis=0, return_inverse=True)
    return np.asarray(numbers.reshape(keys.shape[:-1]))


def _solids(mesh: VolumeMesh) -> PatchSolids:
    """Return the solid of each patch: that of the first group that its element is in, where there are several."""
    number = np.full(len(mesh), -1)
    names: list[str] = []
    for name, rows in mesh.groups.items():
        free = rows[number[rows] < 0]
        if len(free):
            number[free] = len(names)
            names.append(name)
    if len(names) < 2 and not (names and np.any(number < 0)):
        return PatchSolids()
    if np.any(number < 0):
        number[number < 0] = len(names)
        names.append("")
    repeats = np.concatenate([np.full(len(b.nodes), 1 if b.kind.shape == "hexahedron" else 4) for b in mesh.blocks])
    return PatchSolids(np.repeat(number, repeats), tuple(names))
