"""Do elements with det J of one sign overlap? A conforming mesh does not where its boundary does not meet itself.

Faces that two elements have in common are glued, with the two on opposite sides; the theorem of docs/certificate.md
then needs the boundary alone. Nodes in the same place are taken for one: the map is the same.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray, in_brackets
from ..certificate.boundary import settle
from ..spline.body import numbers_of_classes
from .boundary import DEPTH, Quadrilaterals, QuadrilateralSurface, edges_of, quadrilaterals, shells_of
from .edges import around
from .faces import ElementFaces, faces_of, unlike_edge
from .inside import is_inside
from .mesh import VolumeMesh

_NEAR = 1e-10  # of the size: nodes so near to each other may be in one place, up to the decimals of a file
_SHORT = 1e-6  # of the shortest edge: nodes farther from each other are not in one place
_PLUMP = 1e-4  # scaled Jacobian
_FLAT = 1e-9  # of the sum of their magnitudes: more than the terms of a shell's volume can be off


@dataclass(frozen=True)
class OverlapCheck:
    """Whether elements overlap.

    Attributes
    ----------
    overlap : bool or None
        False where it is proved that they do not, True where two elements are found that do; None where neither is
        known.
    reason : str
        Why, in words; "" where they do not.
    elements : tuple of int
        Numbers in the file of elements that the reason speaks of, at most two.
    point : three float or None
        A place that the reason speaks of.
    touching : int
        Pairs of faces in the same place whose nodes are different: they touch, and are not glued.

    Examples
    --------
    >>> from parameterize.meshes.kinds import kind_named
    >>> from parameterize.meshes.mesh import VolumeMesh
    >>> from parameterize.meshes.overlap import check_overlap
    >>> tetra = kind_named("tetra")
    >>> check_overlap(VolumeMesh.of(tetra.lattice, {"tetra": [[0, 1, 2, 3]]}), 1).overlap
    False
    """

    overlap: bool | None
    reason: str = ""
    elements: tuple[int, ...] = ()
    point: tuple[float, float, float] | None = None
    touching: int = 0


def check_overlap(mesh: VolumeMesh, sign: int, scaled: float = 0.0) -> OverlapCheck:
    """Decide whether elements, all of them with sign * det J > 0, overlap.

    scaled: a lower bound of their scaled Jacobian. Where it is not tiny, elements on the same side of faces that are
    one up to rounding are known to overlap.
    """
    if len({block.kind.is_bezier for block in mesh.blocks if max(block.kind.degrees) > 1}) > 1:
        return OverlapCheck(None, "Bezier and Lagrange elements are mixed, whose faces are not compared")
    labels = same_places(mesh.points)
    faces = faces_of(mesh, labels)
    near = _nearly_same(mesh, labels, faces) if scaled > _PLUMP else None
    if near is not None and (found := _same_side(mesh, faces_of(mesh, near))):
        return found
    return replace(_checked(mesh, sign, labels, faces), touching=_touching(mesh, faces, labels))


def _nearly_same(mesh: VolumeMesh, labels: IntArray, faces: ElementFaces) -> IntArray | None:
    """Return labels (n,) that are equal for points of the boundary up to rounding in one place; None without such."""
    points = mesh.points
    corners = np.unique(faces.corners[faces.others < 0])
    corners = corners[corners >= 0]
    if not len(corners):
        return None
    size = float(np.ptp(points[corners], axis=0).max())
    ends = np.sort(np.stack([faces.corners[:, :2], faces.corners[:, 1:3]]).reshape(-1, 2), axis=1)
    shortest = float(np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1).min())
    reach = min(_NEAR * size, _SHORT * shortest)
    pairs = cKDTree(points[corners]).query_pairs(reach, output_type="ndarray")
    if not len(pairs):
        return None
    classes = numbers_of_classes(len(corners), pairs.T)
    first = np.full(len(corners), len(points))
    np.minimum.at(first, classes, corners)
    near = labels.copy()
    near[corners] = first[classes]
    return near[labels]


def _same_side(mesh: VolumeMesh, faces: ElementFaces) -> OverlapCheck | None:
    """Return that elements overlap where two lie on the same side of a face."""
    rows = faces.one_sided if len(faces.one_sided) else faces.crowded
    if not len(rows):
        return None
    own = mesh.numbers[faces.elements[rows]]
    first, second = int(own[0]), int(own[len(rows) // 2 if len(faces.one_sided) else 1])
    side = "lie on the same side of a common face"
    words = side if len(faces.one_sided) else "are among three or more with a common face, of which two lie on one side"
    reason = f"elements {first} and {second} {words}"
    return OverlapCheck(True, reason, (first, second), _middle(mesh, faces, int(rows[0])))


def same_places(points: Array) -> IntArray:
    """Return the number of the first point (n,) in the place of each, its coordinates being equal bit by bit."""
    order = np.lexsort(points.T)
    new = np.append(True, (points[order][1:] != points[order][:-1]).any(axis=1))
    first = np.minimum.reduceat(order, np.flatnonzero(new))
    labels = np.empty(len(points), dtype=np.int64)
    labels[order] = np.repeat(first, np.diff(np.append(np.flatnonzero(new), len(points))))
    return labels


def _touching(mesh: VolumeMesh, faces: ElementFaces, labels: IntArray) -> int:
    """Return how many pairs of glued faces have different nodes in the same places."""
    if np.array_equal(labels, np.arange(len(labels))):
        return 0
    by_nodes = faces_of(mesh, np.arange(len(labels)))
    return int(np.count_nonzero((faces.others >= 0) & (by_nodes.others < 0))) // 2


def _checked(mesh: VolumeMesh, sign: int, labels: IntArray, faces: ElementFaces) -> OverlapCheck:
    if found := _same_side(mesh, faces):
        return found
    if len(faces.unlike):
        count = "1 face" if len(faces.unlike) == 1 else f"{len(faces.unlike)} faces"
        reason = f"{count} of elements have the corner nodes of another one, but other nodes: the mesh does not conform"
        return OverlapCheck(None, reason, *_at(mesh, faces, int(faces.unlike[0])))
    local, back = _local(mesh)
    outer = np.flatnonzero(faces.on_boundary)
    if not len(outer):
        return OverlapCheck(None, "every face has two elements, so that the mesh has no boundary")
    if (row := unlike_edge(mesh, faces, labels, outer)) is not None:
        reason = "edges of elements have the same corner nodes, but other nodes: the mesh does not conform"
        return OverlapCheck(None, reason, *_at(mesh, faces, row))
    pieces = quadrilaterals(mesh, faces, labels, local)
    surface = QuadrilateralSurface(pieces)
    rest = settle(surface, pieces.pieces, pieces.error, DEPTH)
    if rest.met is not None:
        rows, where = rest.met
        point = back(surface.points(rows[:1], where[0][None])[0])
        first, second = mesh.numbers[faces.elements[pieces.faces[rows]]].tolist()
        reason = f"the boundary crosses itself at {in_brackets(point)}, faces of elements {first} and {second}"
        return OverlapCheck(True, reason, (first, second), point)
    if len(rest.pairs):
        return _unproved(mesh, faces, pieces, rest.pieces.patches[rest.pairs], back)
    return _of_shells(mesh, sign, faces, outer, pieces, local)


def _unproved(
    mesh: VolumeMesh,
    faces: ElementFaces,
    found: Quadrilaterals,
    pairs: IntArray,
    back: Callable[[Array], tuple[float, float, float]],
) -> OverlapCheck:
    """Return what is known where pairs (k, 2) of quadrilaterals are not proved to be apart."""
    first, second = pairs[len(pairs) // 2].tolist()
    own = tuple(mesh.numbers[faces.elements[found.faces[[first, second]]]].tolist())
    place = back(found.nets[first].mean(axis=(0, 1)))
    named = f"element {own[0]}" if own[0] == own[1] else f"elements {own[0]} and {own[1]}"
    reason = (
        f"faces touch, or are too near to each other for a proof, such as those of {named} near {in_brackets(place)}"
    )
    return OverlapCheck(None, reason, own, place)


def _of_shells(
    mesh: VolumeMesh, sign: int, faces: ElementFaces, outer: IntArray, found: Quadrilaterals, local: Array
) -> OverlapCheck:
    """Return whether shells, the connected parts of a boundary that does not meet itself, enclose a place twice."""
    ends, counts, edges = edges_of(faces.corners[outer])
    links = np.empty((0, 2), dtype=np.int64)
    if np.any(counts != 2):
        found_around = around(mesh, faces, ends[counts != 2])
        if not found_around.apart:
            words = (
                "overlap around an edge that they touch in" if found_around.apart is False else "touch along an edge"
            )
            reason = (
                f"elements {words}{'' if found_around.apart is False else ', and what lies around it is not proved'}"
            )
            return OverlapCheck(found_around.apart is False or None, reason, *_at(mesh, faces, found_around.row))
        links = np.searchsorted(outer, found_around.links)
    shells = np.unique(shells_of(edges, counts == 2, links), return_inverse=True)[1]
    glued = np.flatnonzero(faces.others >= 0)
    parts = numbers_of_classes(len(mesh), faces.elements[np.stack([glued, faces.others[glued]])])
    flux = np.zeros(len(faces.others))
    np.add.at(flux, found.faces, sign * _fluxes(found.nets))
    own = flux[outer]
    volumes = np.bincount(shells, own)
    if np.any(np.abs(volumes) <= _FLAT * np.bincount(shells, np.abs(own))):
        return OverlapCheck(None, "the volume that a part of the boundary encloses is zero up to rounding")
    part_of_shell = np.empty(len(volumes), dtype=np.int64)
    part_of_shell[shells] = parts[faces.elements[outer]]
    outward = np.flatnonzero(volumes > 0.0)
    count = np.bincount(part_of_shell[outward], minlength=parts.max() + 1)
    if np.any(count != 1):
        part = int(np.argmax(count != 1))
        number = int(mesh.numbers[np.argmax(parts == part)])
        reason = f"the elements connected to element {number} wind more than once around a place"
        return OverlapCheck(True, reason, (number,))
    for shell in outward.tolist() if parts.max() > 0 else ():
        found_inside = _inside(mesh, faces, local, parts, found, outer[shells == shell])
        if found_inside is not None:
            return found_inside
    return OverlapCheck(False)


def _inside(
    mesh: VolumeMesh, faces: ElementFaces, local: Array, parts: IntArray, pieces: Quadrilaterals, rows: IntArray
) -> OverlapCheck | None:
    """Return that the part whose outward shell has faces (k,) lies inside of another one; None where it does not.

    Boundaries do not cross, so that all middles of faces are inside, or none.
    """
    number = faces.elements[rows[0]]
    own = np.flatnonzero(np.isin(pieces.faces, rows))
    middles = QuadrilateralSurface(pieces).points(own, np.full((len(own), 3), 0.5))
    ends = np.concatenate([middles.argmin(axis=0), middles.argmax(axis=0)])
    for point in middles[np.unique(ends)]:
        inside = is_inside(mesh, local, parts != parts[number], point)
        if inside is None:
            return None
    numbers = (int(mesh.numbers[number]), int(mesh.numbers[inside]))
    reason = f"the part of the mesh with element {numbers[0]} lies inside of that with element {numbers[1]}"
    return OverlapCheck(True, reason, numbers, _middle(mesh, faces, int(rows[0])))


def _fluxes(nets: Array) -> Array:
    """Return what each quadrilateral (n, q + 1, q + 1, 3) contributes to the volume inside, by an exact rule."""
    q = nets.shape[1] - 1
    nodes, weights = np.polynomial.legendre.leggauss((3 * q + 1) // 2 + 1)
    t = (nodes + 1.0) / 2.0
    surface = QuadrilateralSurface(Quadrilaterals(nets, np.zeros((0, 4), dtype=np.int64), np.zeros(0, int), 0.0))
    total = np.zeros(len(nets))
    rows = np.arange(len(nets))
    for u, a in zip(t, weights, strict=True):
        for v, b in zip(t, weights, strict=True):
            where = np.tile([u, v, 0.0], (len(nets), 1))
            slopes = surface.jacobian(rows, where)
            # the second parameter leads along the loop, the first to its last corner: that is counter-clockwise
            normals = np.cross(slopes[:, :, 1], slopes[:, :, 0])
            total += a * b / 4.0 * np.einsum("kx,kx->k", surface.points(rows, where), normals) / 3.0
    return total


def _local(mesh: VolumeMesh) -> tuple[Array, Callable[[Array], tuple[float, float, float]]]:
    """Return points moved to the origin and scaled by a power of two to magnitude 1, and the way back for one."""
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    own = mesh.points[used]
    middle = (own.min(axis=0) + own.max(axis=0)) / 2.0
    exponent = int(np.frexp(np.abs(own - middle).max())[1])
    local = np.zeros_like(mesh.points)
    local[used] = np.ldexp(own - middle, -exponent)
    return local, lambda point: _triple(np.ldexp(point, exponent) + middle)


def _at(mesh: VolumeMesh, faces: ElementFaces, row: int) -> tuple[tuple[int, ...], tuple[float, float, float]]:
    """Return the number of the element of a face, and the face's middle."""
    return (int(mesh.numbers[faces.elements[row]]),), _middle(mesh, faces, row)


def _middle(mesh: VolumeMesh, faces: ElementFaces, row: int) -> tuple[float, float, float]:
    corners = faces.corners[row]
    return _triple(mesh.points[corners[corners >= 0]].mean(axis=0))


def _triple(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
