"""Defines Body: one spline volume or several, glued along whole faces, and the numbers of shared control points."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from math import prod
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arrays import Array, Floats, IntArray, Mask
from ..display import Brief, Shown, above
from .archive import is_of_patches, load_patches, load_solids, save_patches
from .interface import WEIGHT_TOLERANCE, Face, Interface, axis_side, face_label, face_layer, knots_agree
from .interface_rows import face_numbers, gaps, group_places, interfaces_of, kinds, oriented, rows_of
from .location import locate
from .patch_groups import PatchGroup, groups_of
from .solids import PatchSolids
from .volume import FACE_NAMES, BSplineVolume, demand_volume

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

TOLERANCE = 1e-6  # of the body's size: distance of two control points that are taken for one
NEAR = 1e3  # times the tolerance: faces so near to each other are perhaps meant to be one
SAMPLES = 5  # points a direction at which two faces over the same corners are compared
FLAT = 1e-9  # of the squared size: the area of a face that has shrunk to an edge or a point


@dataclass(frozen=True, eq=False, repr=False)
class Body(Brief, Shown):
    """One spline volume, or several that are glued along whole faces.

    Functions that take a body also take a volume, as a body of one patch.

    Parameters
    ----------
    patches : tuple of BSplineVolume
        Of any degrees and knots.
    interfaces : tuple of Interface
        Pairs of faces with equal degrees, knots, control points and, up to a factor, weights; a face is glued once at
        most.
    solids : PatchSolids, or sequence of str or of int
        The solid of each patch, by its name or its number, where the body has several: each has its own material.

    Raises
    ------
    ValueError
        Where two faces of an interface do not have the same trace; the message names the faces. Where `solids` are
        those of more or fewer patches.

    Examples
    --------
    >>> import iga_nn
    >>> left = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=4)
    >>> right = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 - u, 1 - v, w), control_points=4)
    >>> rod = iga_nn.Body.from_patches([left, right])
    >>> print(rod.interfaces[0], len(rod.outer[0]))
    p0_u1 = p1_u1 5
    """

    patches: tuple[BSplineVolume, ...]
    interfaces: tuple[Interface, ...] = ()
    solids: PatchSolids = field(default_factory=PatchSolids, repr=False)

    def __post_init__(self) -> None:
        _demand_list(self.patches, Iterable)
        object.__setattr__(self, "patches", tuple(self.patches))
        object.__setattr__(self, "interfaces", tuple(self.interfaces))
        if not self.patches:
            raise ValueError("a body has one patch or more")
        for patch in self.patches:
            demand_volume(patch)
        object.__setattr__(self, "solids", PatchSolids.of(self.solids, len(self.patches)))
        for interface in self.interfaces:
            if not isinstance(interface, Interface):
                raise TypeError(f"interfaces must be Interface objects, got {interface!r:.80}")
        if self.interfaces:
            self._check_interfaces()

    def _check_interfaces(self) -> None:
        """Raise ValueError for interfaces of other patches, of a face that is glued twice, or without equal traces."""
        rows = self.interface_rows
        outside = ((rows[:, [0, 2]] < 0) | (rows[:, [0, 2]] >= len(self))).any(axis=1)
        if outside.any():
            unknown = self.interfaces[int(outside.argmax())]
            raise ValueError(f"interface {unknown}: there are {len(self)} patches, from 0 on")
        faces, counts = np.unique(face_numbers(rows), return_counts=True)
        if counts.max() > 1:
            raise ValueError(f"{face_label(*_face(int(faces[counts.argmax()])))} is glued twice")
        apart = gaps(self.groups, rows) > 0.0
        if apart.any():
            wrong = self.interfaces[int(apart.argmax())]
            if not knots_agree(self.patches, wrong):
                raise ValueError(f"interface {wrong}: degrees or knots along the two faces differ")
            raise ValueError(f"interface {wrong}: the control points or weights of the two faces differ")
        if len(faces) == len(FACE_NAMES) * len(self):
            raise ValueError("every face is glued, so that the body has no boundary: is a patch given twice?")

    @classmethod
    def from_patches(
        cls,
        patches: Sequence[BSplineVolume],
        tolerance: float = TOLERANCE,
        solids: PatchSolids | Sequence[str] | Sequence[int] = (),
    ) -> "Body":
        """Return the body of patches, glued where two faces have the same control points.

        tolerance: the largest distance of two control points that are taken for one, as a share of the body's size;
        they become one, that of the patch that comes first. solids: the name or the number of each patch's solid.
        Raises ValueError where two faces are the same surface, but do not have the same degrees, knots and weights,
        where three faces are the same, and where `solids` are those of more or fewer patches.
        """
        _demand_list(patches, Sequence)
        given = tuple(patches)
        if not given:
            raise ValueError("a body has one patch or more")
        for patch in given:
            demand_volume(patch)
        if not (isinstance(tolerance, Real) and 0.0 <= tolerance < 1.0):
            raise ValueError(f"tolerance must be a share of the body's size, from 0 to 1, got {tolerance!r:.80}")
        size = size_of(given)
        found = interfaces_of(_matches(given, tolerance * size, size))
        return cls(merged(given, found), found, PatchSolids.of(solids, len(given)))

    @classmethod
    def from_splinepy(cls, splines: Any) -> "Body":
        """Make the body of a splinepy.Multipatch, or of a list of its splines, glued as by `from_patches`.

        Raises TypeError for other objects, ValueError where the splines are no volumes or do not fit together.
        """
        return above("io.splinepy").body_from_splinepy(splines)

    def to_splinepy(self) -> Any:
        """Return the same body as a splinepy.Multipatch. Raises InputError where splinepy is missing."""
        return above("io.splinepy").body_to_splinepy(self)

    def to_pyvista(self, samples: int | None = None) -> "pyvista.UnstructuredGrid":
        """Return the body as a grid of pyvista with the cell data `patch`; as `BSplineVolume.to_pyvista`."""
        return above("io.view").grid(self, samples=samples)

    def plot(self, what: str = "faces", file: str | Path | None = None) -> "Figure":
        """Return a figure of the body; as `BSplineVolume.plot`."""
        return above("figures.map").plot_body(self, what, file)

    def save(self, path: str | Path) -> None:
        """Write patches, interfaces and solids as volume.npz; atomic. One patch that is not glued is a volume there."""
        if self.is_single:
            self.only.save(path)
        else:
            save_patches(path, self.patches, self.interfaces, self.solids)

    @classmethod
    def load(cls, path: str | Path) -> "Body":
        """Read volume.npz, of one patch or several.

        Raises FileNotFoundError, or ValueError that names the defect of the file.
        """
        if not is_of_patches(path):
            return cls((BSplineVolume.load(path),))
        patches, interfaces = load_patches(path)
        try:
            return cls(patches, interfaces, load_solids(path))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    @property
    def is_single(self) -> bool:
        """Return whether the body is one patch that is not glued to itself: the image of a cube."""
        return len(self.patches) == 1 and not self.interfaces

    @property
    def only(self) -> BSplineVolume:
        """Return the patch of a body of one. Raises ValueError for several."""
        if len(self.patches) > 1:
            raise ValueError(f"this body has {len(self.patches)} patches: use body.patches[i]")
        return self.patches[0]

    @property
    def simplest(self) -> "BodyLike":
        """Return the volume of a body that is the image of a cube, otherwise the body.

        Users hold what a function returns: they call `locate` of a volume, which names no patch, and replace its parts.
        """
        return self.only if self.is_single else self

    def face_name(self, patch: int, face: str) -> str:
        """Return the name by which data and regions call a face: "u0" of a single patch, "p2_u0" of several."""
        return face if self.is_single else face_label(patch, face)

    @cached_property
    def groups(self) -> tuple[PatchGroup, ...]:
        """Return the patches in groups of equal degrees and knots, in the order of their first patches."""
        return groups_of(self.patches)

    @cached_property
    def numbering(self) -> tuple[tuple[IntArray, ...], int]:
        """Return the number of each control point of each patch, and how many there are; see `shared_numbers`."""
        return shared_numbers([patch.shape for patch in self.patches], self.interfaces)

    @cached_property
    def size(self) -> float:
        """Return the longest side of the box of all control points."""
        return size_of(self.patches)

    def points(self, patches: ArrayLike, parameters: ArrayLike) -> Array:
        """Return the points (m, 3) in space of parameters (m, 3) of patches (m,): what `locate` finds.

        Raises ValueError for other shapes, and for the number of a patch that does not exist.
        """
        return self._of_groups(patches, parameters, PatchGroup.at, 3)

    def jacobian(self, patches: ArrayLike, parameters: ArrayLike) -> Array:
        """Return J[i, a, b] = dF_a / du_b (m, 3, 3) at parameters (m, 3) of patches (m,). Raises as `points`."""
        return self._of_groups(patches, parameters, PatchGroup.jacobian, 3, 3)

    def _of_groups(
        self,
        patches: ArrayLike,
        parameters: ArrayLike,
        values: Callable[[PatchGroup, IntArray, Array], Array],
        *shape: int,
    ) -> Array:
        """Return the values (m, *shape) of a function of a group, places in it and parameters."""
        owners, where = np.asarray(patches), np.asarray(parameters, dtype=np.float64)
        if owners.shape != (len(where),) or where.shape[1:] != (3,):
            raise ValueError(f"give patches (m,) and parameters (m, 3), got shapes {owners.shape} and {where.shape}")
        if (unknown := (owners < 0) | (owners >= len(self))).any():
            raise ValueError(f"there is no patch {owners[unknown].min()}: the body has {len(self)}, from 0 on")
        found = np.empty((len(where), *shape))
        labels, places = (row[owners.astype(np.int64)] for row in group_places(self.groups))
        for label in np.unique(labels):
            own = np.flatnonzero(labels == label)
            found[own] = values(self.groups[label], places[own], where[own])
        return found

    def locate(self, points: ArrayLike) -> tuple[IntArray, Array]:
        """Return the patches (m,) and the parameters (m, 3) of points (m, 3) in space, -1 and NaN outside of the body.

        On an interface the patch with the smaller number is taken. Raises ValueError as `BSplineVolume.locate`.
        """
        return locate(self.patches, points)

    @property
    def nearly_glued(self) -> list[tuple[Interface, float]]:
        """Return pairs of outer faces that almost have the same control points, with the largest distance of two.

        They are not glued: `from_patches` does so with a larger tolerance. Faces farther apart than NEAR times the
        default tolerance are not looked at.
        """
        try:
            rows = _matches(self.patches, NEAR * TOLERANCE * self.size, self.size)
        except ValueError:  # faces that from_patches would refuse: they are no pair
            return []
        rows = rows[~self.glued[rows[:, 0], rows[:, 1]]]
        return list(zip(interfaces_of(rows), gaps(self.groups, rows).tolist(), strict=True))

    @property
    def parts(self) -> list[list[int]]:
        """Return the numbers of the patches that are connected through interfaces, one list a part."""
        labels = numbers_of_classes(len(self), self.interface_rows[:, [0, 2]].T)
        begins = np.cumsum(np.bincount(labels))[:-1]
        return [part.tolist() for part in np.split(np.argsort(labels, kind="stable"), begins)]

    @cached_property
    def interface_rows(self) -> IntArray:
        """Return the interfaces as rows (k, 7), see interface_rows.py."""
        return rows_of(self.interfaces)

    @cached_property
    def glued(self) -> Mask:
        """Return whether each face of each patch is glued, (patches, 6) in the order of FACE_NAMES."""
        glued = np.zeros(len(FACE_NAMES) * len(self), dtype=bool)
        glued[face_numbers(self.interface_rows)] = True
        return glued.reshape(len(self), len(FACE_NAMES))

    @cached_property
    def outer(self) -> tuple[tuple[str, ...], ...]:
        """Return for each patch the names of the faces that are not glued: together they are the body's boundary."""
        return tuple(tuple(compress(FACE_NAMES, row)) for row in (~self.glued).tolist())

    @property
    def outer_faces(self) -> list[Face]:
        """Return patch and name of the faces that are not glued."""
        return [(patch, face) for patch, faces in enumerate(self.outer) for face in faces]

    def __len__(self) -> int:
        return len(self.patches)

    def __iter__(self) -> Iterator[BSplineVolume]:
        return iter(self.patches)


def all_control_points(patches: Iterable[BSplineVolume]) -> Array:
    """Return the control points (m, 3) of patches, those on interfaces once for each patch."""
    return np.concatenate([patch.control_points.reshape(-1, 3) for patch in patches])


def size_of(patches: Iterable[BSplineVolume]) -> float:
    """Return the longest side of the box of all control points."""
    return float(np.ptp(all_control_points(patches), axis=0).max())


BodyLike = BSplineVolume | Body  # what users give and get: a volume is a body of one patch


def as_body(body: BodyLike) -> Body:
    """Return a body, a volume as one of one patch: the one place that asks which of the two users gave.

    Raises TypeError for another object.
    """
    if isinstance(body, Body):
        return body
    demand_volume(body)
    return Body((body,))


def _demand_list(patches: object, kind: type) -> None:
    """Raise TypeError for patches that are not of this kind of list."""
    if not isinstance(patches, kind):
        raise TypeError(f"patches must be a list of volumes, got {type(patches).__name__}")


def shared_numbers(
    shapes: Sequence[tuple[int, ...]], interfaces: Sequence[Interface]
) -> tuple[tuple[IntArray, ...], int]:
    """Return the number of each coefficient of each patch, arrays of the given shapes, and how many numbers there are.

    Coefficients that the interfaces make one have the same number. Numbers begin with 0, in the order in which the
    coefficients of the patches come.
    """
    sizes = np.array([prod(shape) for shape in shapes])
    starts = np.cumsum(sizes) - sizes
    labels = {shape: label for label, shape in enumerate(dict.fromkeys(shapes))}
    own = [np.arange(prod(shape)).reshape(shape) for shape in labels]
    rows = rows_of(interfaces)
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for kind, members in kinds(rows, np.array([labels[shape] for shape in shapes])):
        (p, face_p), (q, face_q) = kind.first, kind.second
        layers = np.stack([face_layer(own[p], face_p), kind.turned(face_layer(own[q], face_q))]).reshape(2, 1, -1)
        pairs.append((starts[rows[members][:, [0, 2]]].T[..., None] + layers).reshape(2, -1))
    numbers = numbers_of_classes(int(sizes.sum()), np.concatenate(pairs, axis=1))
    return tuple(parted(numbers, shapes)), int(numbers.max()) + 1


def parted(values: Floats, shapes: Sequence[tuple[int, ...]]) -> Iterator[Floats]:
    """Yield the values (n, ...) of all coefficients patch by patch, in the patches' shapes."""
    ends = np.cumsum([prod(shape) for shape in shapes])
    for part, shape in zip(np.split(values, ends[:-1]), shapes, strict=True):
        yield part.reshape(*shape, *values.shape[1:])


def numbers_of_classes(count: int, pairs: IntArray) -> IntArray:
    """Return the class (count,) of each of `count` things, of which pairs (2, k) are one.

    Classes have the numbers from 0 on, in the order in which their first members come.
    """
    graph = coo_array((np.ones(pairs.shape[1], dtype=np.int8), (pairs[0], pairs[1])), shape=(count,) * 2)
    classes, labels = connected_components(graph, directed=False)
    first = np.full(classes, count)
    np.minimum.at(first, labels, np.arange(count))
    rank = np.zeros(count, dtype=np.int64)
    rank[first] = 1
    return np.asarray(np.cumsum(rank)[first[labels]] - 1)


def merged(patches: Sequence[BSplineVolume], interfaces: Sequence[Interface]) -> tuple[BSplineVolume, ...]:
    """Return the patches with one control point where interfaces make several one, the first of them.

    Its weight goes with it, except to patches whose weights there are other ones by a factor.
    """
    shapes = [patch.shape for patch in patches]
    labels = np.concatenate([part.ravel() for part in shared_numbers(shapes, interfaces)[0]])
    first = np.flatnonzero(np.diff(np.maximum.accumulate(labels), prepend=-1))  # of each number, which come in order
    points = all_control_points(patches)[first][labels]
    own = np.concatenate([np.ones(p.shape).ravel() if p.weights is None else p.weights.ravel() for p in patches])
    weights = np.where(_alike(own[first][labels], own), own[first][labels], own)
    return tuple(
        replace(patch, control_points=net, weights=row)
        for patch, net, row in zip(patches, parted(points, shapes), parted(weights, shapes), strict=True)
    )


def _alike(one: Array, other: Array) -> Mask:
    return np.abs(one - other) <= WEIGHT_TOLERANCE * other


def _matches(patches: Sequence[BSplineVolume], tolerance: float, size: float) -> IntArray:
    """Return the pairs of faces with the same control points as rows (k, 7), see interface_rows.py.

    Raises ValueError for pairs that nearly match, and where three faces are one.
    """
    groups = groups_of(patches)
    corners, areas = _faces(groups)
    solid = np.flatnonzero(areas > FLAT * size**2)
    near = cKDTree(corners[solid].mean(axis=1)).query_pairs(2.0 * tolerance, output_type="ndarray")
    pairs = solid[near[np.lexsort(near.T[::-1])]]
    pairs = pairs[_same_points(corners[pairs[:, 0]], corners[pairs[:, 1]], tolerance)]
    rows, others = oriented(groups, pairs, tolerance)
    for pair in pairs[others].tolist():
        _refuse_one_surface(patches, [_face(number) for number in pair], tolerance)
    _refuse_three(face_numbers(rows).ravel())
    return rows


def _faces(groups: Sequence[PatchGroup]) -> tuple[Array, Array]:
    """Return the corners (faces, 4, 3) and the areas (faces,) of the faces of all patches, six a patch."""
    count = sum(map(len, groups))
    corners, areas = np.empty((count, len(FACE_NAMES), 4, 3)), np.empty((count, len(FACE_NAMES)))
    for group in groups:
        for number, name in enumerate(FACE_NAMES):
            nets = face_layer(np.moveaxis(group.control_points, 0, 3), name)  # (n_a, n_b, k, 3)
            ends = nets[:: len(nets) - 1, :: nets.shape[1] - 1]
            corners[group.numbers, number] = np.moveaxis(ends.reshape(4, -1, 3), 1, 0)
            areas[group.numbers, number] = net_area(nets)
    return corners.reshape(-1, 4, 3), areas.ravel()


def net_area(net: Array) -> Floats:
    """Return the areas (...) of control nets (n_a, n_b, ..., 3) of faces, each the sum over its cells."""
    a, b = np.diff(net, axis=0)[:, :-1], np.diff(net, axis=1)[:-1]
    return np.asarray(np.linalg.norm(np.cross(a, b), axis=-1).sum(axis=(0, 1)))


def _same_points(one: Array, other: Array, tolerance: float) -> Mask:
    """Return whether each point of either set (m, k, 3) lies within the tolerance of one of the other set, (m,)."""
    distances = np.linalg.norm(one[:, :, None] - other[:, None], axis=-1)
    return np.asarray(np.maximum(distances.min(axis=1), distances.min(axis=2)).max(axis=1) <= tolerance)


def _face(number: int) -> Face:
    """Return patch and name of the face 6 * patch + face."""
    patch, face = divmod(number, len(FACE_NAMES))
    return patch, FACE_NAMES[face]


def _refuse_one_surface(patches: Sequence[BSplineVolume], faces: Sequence[Face], tolerance: float) -> None:
    """Raise ValueError where two faces over the same corners, which do not lie on each other, are the same surface."""
    one, other = (_samples(patches[number], name) for number, name in faces)
    if _same_points(one[None], other[None], tolerance).all():
        raise ValueError(
            f"{face_label(*faces[0])} and {face_label(*faces[1])} are the same surface, but of other degrees, "
            "knots or weights: give both faces the same ones"
        )


def _refuse_three(faces: IntArray) -> None:
    """Raise ValueError where a face comes twice among faces, of which each two neighbours are a pair."""
    again = np.setdiff1d(np.arange(len(faces)), np.unique(faces, return_index=True)[1])
    if len(again):
        second = int(again[0])
        first = int((faces == faces[second]).argmax())
        names = ", ".join(face_label(*_face(int(faces[k]))) for k in (second, second ^ 1, first ^ 1))
        raise ValueError(f"{names} are one surface: at most two patches meet at a face")


def _samples(volume: BSplineVolume, face: str) -> Array:
    """Return points (k, 3) of a face at even parameters, the same points however the parameters run."""
    axis, side = axis_side(face)
    even = np.linspace(0.0, 1.0, SAMPLES)
    u, v, w = (np.array([float(side)]) if a == axis else even for a in range(3))
    return volume.grid(u, v, w).reshape(-1, 3)
