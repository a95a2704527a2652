"""Defines Body: one spline volume or several, glued along whole faces, and the numbers of shared control points."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray, Mask
from ..display import Brief, Shown, above
from .archive import is_of_patches, load_patches, save_patches
from .interface import (
    WEIGHT_TOLERANCE,
    Face,
    Interface,
    axis_side,
    face_label,
    face_layer,
    gap,
    knots_agree,
    orientations,
)
from .patch_groups import PatchGroup, groups_of
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

    Raises
    ------
    ValueError
        Where two faces of an interface do not have the same trace; the message names the faces.

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

    def __post_init__(self) -> None:
        _demand_list(self.patches, Iterable)
        object.__setattr__(self, "patches", tuple(self.patches))
        object.__setattr__(self, "interfaces", tuple(self.interfaces))
        if not self.patches:
            raise ValueError("a body has one patch or more")
        for patch in self.patches:
            demand_volume(patch)
        seen: set[Face] = set()
        for interface in self.interfaces:
            if not isinstance(interface, Interface):
                raise TypeError(f"interfaces must be Interface objects, got {interface!r:.80}")
            for number, face in (interface.first, interface.second):
                if not 0 <= number < len(self.patches):
                    raise ValueError(f"interface {interface}: there are {len(self.patches)} patches, from 0 on")
                if (number, face) in seen:
                    raise ValueError(f"{face_label(number, face)} is glued twice")
                seen.add((number, face))
            if not knots_agree(self.patches, interface):
                raise ValueError(f"interface {interface}: degrees or knots along the two faces differ")
            if gap(self.patches, interface) > 0.0:
                raise ValueError(f"interface {interface}: the control points or weights of the two faces differ")
        if len(seen) == len(FACE_NAMES) * len(self.patches):
            raise ValueError("every face is glued, so that the body has no boundary: is a patch given twice?")

    @classmethod
    def from_patches(cls, patches: Sequence[BSplineVolume], tolerance: float = TOLERANCE) -> "Body":
        """Return the body of patches, glued where two faces have the same control points.

        tolerance: the largest distance of two control points that are taken for one, as a share of the body's size;
        they become one, that of the patch that comes first. Raises ValueError where two faces are the same
        surface, but do not have the same degrees, knots and weights, and where three faces are the same.
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
        found = tuple(_interfaces(given, tolerance * size, size))
        labels, _ = shared_numbers([patch.shape for patch in given], found)
        return cls(_merged(given, labels), found)

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
        """Write the patches and interfaces as volume.npz; atomic. One patch that is not glued is a volume there."""
        if self.is_single:
            self.only.save(path)
        else:
            save_patches(path, self.patches, self.interfaces)

    @classmethod
    def load(cls, path: str | Path) -> "Body":
        """Read volume.npz, of one patch or several.

        Raises FileNotFoundError, or ValueError that names the defect of the file.
        """
        if not is_of_patches(path):
            return cls((BSplineVolume.load(path),))
        patches, interfaces = load_patches(path)
        try:
            return cls(patches, interfaces)
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
        owners, where = np.asarray(patches), np.asarray(parameters, dtype=np.float64)
        if owners.shape != (len(where),) or where.shape[1:] != (3,):
            raise ValueError(f"give patches (m,) and parameters (m, 3), got shapes {owners.shape} and {where.shape}")
        if unknown := sorted(set(np.unique(owners).tolist()) - set(range(len(self)))):
            raise ValueError(f"there is no patch {unknown[0]}: the body has {len(self)}, from 0 on")
        found = np.empty(where.shape)
        for number, patch in enumerate(self.patches):
            own = np.flatnonzero(owners == number)
            if own.size:
                found[own] = patch(where[own])
        return found

    def locate(self, points: ArrayLike) -> tuple[IntArray, Array]:
        """Return the patches (m,) and the parameters (m, 3) of points (m, 3) in space, -1 and NaN outside of the body.

        On an interface the patch with the smaller number is taken. Raises ValueError as `BSplineVolume.locate`.
        """
        where = self.patches[0].locate(points)
        owners: IntArray = np.where(np.isnan(where[:, 0]), -1, 0)
        for number, patch in enumerate(self.patches[1:], start=1):
            missing = np.flatnonzero(owners < 0)
            if len(missing):
                where[missing] = patch.locate(np.atleast_2d(np.asarray(points, dtype=np.float64))[missing])
                owners[missing] = np.where(np.isnan(where[missing, 0]), -1, number)
        return owners, where

    @property
    def nearly_glued(self) -> list[tuple[Interface, float]]:
        """Return pairs of outer faces that almost have the same control points, with the largest distance of two.

        They are not glued: `from_patches` does so with a larger tolerance. Faces farther apart than NEAR times the
        default tolerance are not looked at.
        """
        try:
            found = list(_interfaces(self.patches, NEAR * TOLERANCE * self.size, self.size))
        except ValueError:  # faces that from_patches would refuse: they are no pair
            return []
        glued = {interface.first for interface in self.interfaces}
        return [(one, gap(self.patches, one)) for one in found if one.first not in glued]

    @property
    def parts(self) -> list[list[int]]:
        """Return the numbers of the patches that are connected through interfaces, one list a part."""
        pairs = np.array([(i.first[0], i.second[0]) for i in self.interfaces], dtype=np.int64).reshape(-1, 2)
        graph = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(len(self),) * 2)
        count, labels = connected_components(graph, directed=False)
        return [np.flatnonzero(labels == part).tolist() for part in range(count)]

    @cached_property
    def outer(self) -> tuple[tuple[str, ...], ...]:
        """Return for each patch the names of the faces that are not glued: together they are the body's boundary."""
        glued = {face for interface in self.interfaces for face in (interface.first, interface.second)}
        return tuple(tuple(name for name in FACE_NAMES if (i, name) not in glued) for i in range(len(self.patches)))

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
    sizes = [int(np.prod(shape)) for shape in shapes]
    starts = [0, *np.cumsum(sizes).tolist()]
    rows = [np.arange(a, b).reshape(shape) for a, b, shape in zip(starts, starts[1:], shapes, strict=False)]
    pairs: list[Any] = [np.empty((2, 0), dtype=np.int64)]
    for interface in interfaces:
        (p, face_p), (q, face_q) = interface.first, interface.second
        first, second = face_layer(rows[p], face_p), interface.turned(face_layer(rows[q], face_q))
        pairs.append(np.stack([first.ravel(), second.ravel()]))
    numbers = numbers_of_classes(starts[-1], np.concatenate(pairs, axis=1))
    return tuple(numbers[row] for row in rows), int(numbers.max()) + 1


def numbers_of_classes(count: int, pairs: IntArray) -> IntArray:
    """Return the class (count,) of each of `count` things, of which pairs (2, k) are one.

    Classes have the numbers from 0 on, in the order in which their first members come.
    """
    graph = coo_array((np.ones(pairs.shape[1], dtype=np.int8), (pairs[0], pairs[1])), shape=(count,) * 2)
    _, first_places, groups = np.unique(
        connected_components(graph, directed=False)[1], return_index=True, return_inverse=True
    )
    order: IntArray = np.empty(len(first_places), dtype=np.int64)
    order[np.argsort(first_places)] = np.arange(len(first_places))
    return order[groups]


def _merged(patches: Sequence[BSplineVolume], labels: Sequence[IntArray]) -> tuple[BSplineVolume, ...]:
    """Return the patches with one control point for each label, the first that has it.

    Its weight goes with it, except to patches whose weights there are other ones by a factor.
    """
    every = np.concatenate([label.ravel() for label in labels])
    points = all_control_points(patches)
    _, first = np.unique(every, return_index=True)
    own = [np.ones(patch.shape) if patch.weights is None else patch.weights for patch in patches]
    chosen, weights = points[first], np.concatenate([row.ravel() for row in own])[first]
    return tuple(
        replace(patch, control_points=chosen[label], weights=np.where(_alike(weights[label], row), weights[label], row))
        for patch, label, row in zip(patches, labels, own, strict=True)
    )


def _alike(one: Array, other: Array) -> Mask:
    return np.abs(one - other) <= WEIGHT_TOLERANCE * other


def _interfaces(patches: Sequence[BSplineVolume], tolerance: float, size: float) -> Iterator[Interface]:
    """Yield the pairs of faces with the same control points; raise ValueError for those that nearly match."""
    faces = [(i, name) for i in range(len(patches)) for name in FACE_NAMES]
    nets = [face_layer(patches[i].control_points, name) for i, name in faces]
    has_area = [net_area(net) > FLAT * size**2 for net in nets]
    middles = np.array([_corners(net).mean(axis=0) for net in nets])
    taken: dict[int, int] = {}
    for i, j in sorted(cKDTree(middles).query_pairs(2.0 * tolerance)):
        if not (has_area[i] and has_area[j]) or not _same_points(_corners(nets[i]), _corners(nets[j]), tolerance):
            continue
        ways = (way for way in orientations(faces[i], faces[j]) if knots_agree(patches, way))
        way = next((way for way in ways if gap(patches, way) <= tolerance), None)
        if way is None:
            one, other = (_samples(patches[p], name) for p, name in (faces[i], faces[j]))
            if _same_points(one, other, tolerance):
                raise ValueError(
                    f"{face_label(*faces[i])} and {face_label(*faces[j])} are the same surface, but of other degrees, "
                    "knots or weights: give both faces the same ones"
                )
            continue  # two surfaces over the same corners
        for k, partner in ((i, j), (j, i)):
            if k in taken:
                names = ", ".join(face_label(*faces[m]) for m in (k, partner, taken[k]))
                raise ValueError(f"{names} are one surface: at most two patches meet at a face")
            taken[k] = partner
        yield way


def _samples(volume: BSplineVolume, face: str) -> Array:
    """Return points (k, 3) of a face at even parameters, the same points however the parameters run."""
    axis, side = axis_side(face)
    even = np.linspace(0.0, 1.0, SAMPLES)
    u, v, w = (np.array([float(side)]) if a == axis else even for a in range(3))
    return volume.grid(u, v, w).reshape(-1, 3)


def _corners(net: Array) -> Array:
    """Return the four corners (4, 3) of a face's control points (n_a, n_b, 3)."""
    return net[:: len(net) - 1, :: net.shape[1] - 1].reshape(4, 3)


def net_area(net: Array) -> float:
    """Return the area of a face's control net, sum over its cells."""
    a, b = np.diff(net, axis=0)[:, :-1], np.diff(net, axis=1)[:-1]
    return float(np.linalg.norm(np.cross(a, b), axis=-1).sum())


def _same_points(one: Array, other: Array, tolerance: float) -> bool:
    """Return whether each point of either set (k, 3) lies within the tolerance of one of the other set."""
    ways = ((one, other), (other, one))
    return all(float(np.max(cKDTree(b).query(a)[0])) <= tolerance for a, b in ways)
