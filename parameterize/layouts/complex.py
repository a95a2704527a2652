"""Defines Complex, the geometry of all blocks: hexahedra by vertex numbers, glued where faces have the same vertices.

Rods along a skeleton, hexahedra between planes, blocks over outlines and stubs on a body are complexes; `spline_of`
makes the spline map of any of them.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray, Mask
from ..certificate.boundary import check_boundary
from ..certificate.certify import certify
from ..spline.body import Body
from ..spline.bspline import greville, open_uniform_knots
from ..spline.interface import Face, Interface, face_layer, orientations
from ..spline.interface_rows import COLUMNS, face_numbers, interfaces_of
from ..spline.patch_groups import groups_of
from ..spline.spline_map import ControlNets, SplineMap, tied_spans
from ..spline.volume import FACE_NAMES, BSplineVolume

MOST_BLOCKS = 150  # a body that needs more is not made of blocks between planes or over outlines
FEWEST_SPANS = 2  # along an edge of such a block
_LONGEST = 4  # times the spans of a block that is a cube: those along one direction, at most


@dataclass(frozen=True, eq=False)
class Complex:
    """Hexahedra with common vertices.

    Attributes
    ----------
    points : (n, 3) array
        Of the vertices.
    hexahedra : (k, 2, 2, 2) array of int
        The vertices [u][v][w] of each; (u, v, w) is right-handed.
    names : tuple of str
        What each hexahedron is of the body, for messages and reports; () where they have no names.
    bends : mapping of int to (2, 2, m) array of int
        Of a hexahedron of m - 1 straight pieces along w the vertices of all sections, which are evenly spaced in w.
    surfaces : mapping of (int, str) to (n_u, n_v, 3) array
        Control points of curved faces by hexahedron and face, such as (0, "w1"), of the degree of the map. Both w0 and
        w1 of a hexahedron have one, or none of its faces.
    class_spans : (c,) array of int
        The number of knot spans of the edges of each class, see `classes`; one each if it is empty.
    """

    points: Array
    hexahedra: IntArray
    names: tuple[str, ...] = ()
    bends: Mapping[int, IntArray] = field(default_factory=dict)
    surfaces: Mapping[Face, Array] = field(default_factory=dict)
    class_spans: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @classmethod
    def of(cls, points: Array, sections: Mapping[str, IntArray], spans: ArrayLike) -> "Complex":
        """Return the complex of named hexahedra, given by the vertices (2, 2, m) of their sections along w.

        spans: (k, 3), the knot spans of each along u, v and w.
        """
        rows = list(sections.values())
        bends = {k: row for k, row in enumerate(rows) if row.shape[2] > 2}
        return cls(points, np.array([row[:, :, [0, -1]] for row in rows]), tuple(sections), bends).with_spans(spans)

    def __len__(self) -> int:
        return len(self.hexahedra)

    def sections(self, number: int) -> IntArray:
        """Return the vertices (2, 2, m) of all sections of a hexahedron along w, m >= 2."""
        return self.bends.get(number, self.hexahedra[number])

    @cached_property
    def interfaces(self) -> tuple[Interface, ...]:
        """Return the pairs of faces that have the same vertices, each turned so that they lie on each other."""
        tables = defaultdict(list)
        for numbers, sections in self._sections():
            for face, name in enumerate(FACE_NAMES):
                vertices = np.moveaxis(face_layer(np.moveaxis(sections, 0, 3), name), 2, 0)
                tables[vertices.shape[1:]].append((len(FACE_NAMES) * numbers + face, vertices))
        rows = [_glued(*map(np.concatenate, zip(*parts, strict=True))) for parts in tables.values()]
        together = np.concatenate(rows)
        return interfaces_of(together[np.argsort(face_numbers(together)[:, 1])])

    def _sections(self) -> Iterator[tuple[IntArray, IntArray]]:
        """Yield the numbers (k,) of hexahedra with equally many sections, and the vertices (k, 2, 2, m) of these."""
        straight = np.setdiff1d(np.arange(len(self)), list(self.bends))
        yield straight, self.hexahedra[straight]
        for number, vertices in self.bends.items():
            yield np.array([number]), vertices[None]

    @cached_property
    def exposed(self) -> Mask:
        """Return whether each face is not glued: (k, 6), in the order u0, u1, v0, v1, w0, w1."""
        return self._cubes.exposed.reshape(-1, len(FACE_NAMES))

    @cached_property
    def classes(self) -> IntArray:
        """Return the class of the edges of each hexahedron along u, v and w, (k, 3): glued edges have the same one."""
        return np.concatenate(tied_spans(self._cubes)).reshape(-1, 3)

    @cached_property
    def _cubes(self) -> ControlNets:
        """Return control nets of one span a direction."""
        knots = (open_uniform_knots(2, 1),) * 3
        return ControlNets(1, (knots,) * len(self), self.interfaces)

    @property
    def spans(self) -> IntArray:
        """Return the knot spans of each hexahedron along u, v and w, (k, 3)."""
        return self.class_spans[self.classes] if len(self.class_spans) else np.ones((len(self), 3), dtype=np.int64)

    def with_spans(self, wanted: ArrayLike) -> "Complex":
        """Return the complex whose edges have the largest number of spans (k, 3) that is wanted in their class.

        Raises ValueError for numbers below 1.
        """
        rows = np.broadcast_to(np.asarray(wanted, dtype=np.int64), (len(self), 3))
        if rows.min() < 1:
            raise ValueError(f"each direction of a block needs one span or more, got {rows.min()}")
        largest = np.zeros(int(self.classes.max()) + 1, dtype=np.int64)
        np.maximum.at(largest, self.classes, rows)
        return replace(self, class_spans=largest)

    @property
    def lengths(self) -> Array:
        """Return the mean lengths (k, 3) of the straight edges of each hexahedron along u, v and w."""
        corners = self.points[self.hexahedra]
        rows = [np.linalg.norm(np.diff(corners, axis=1 + axis), axis=-1).mean(axis=(1, 2, 3)) for axis in range(3)]
        return np.stack(rows, axis=1)

    def with_even_spans(self, lengths: Array, spans: int, fewest: int | IntArray = FEWEST_SPANS) -> "Complex":
        """Return the complex with spans in proportion to mean lengths (k, 3) of the edges along u, v and w.

        spans: of a cube as large as the mean block; along one direction there are at most _LONGEST times as many.
        fewest: in each direction of each hexahedron (k, 3).
        """
        classes = self.classes.ravel()
        means = np.bincount(classes, lengths.ravel()) / np.bincount(classes)
        least = self.with_spans(fewest).class_spans
        mean_edge = float(np.cbrt(lengths.prod(axis=1).mean()))
        return replace(
            self, class_spans=np.clip(np.round(means / (mean_edge / spans)), least, _LONGEST * spans).astype(np.int64)
        )

    def nets(self, degree: int) -> ControlNets:
        """Return the control nets of the hexahedra, with uniform knots."""
        knots = [tuple(open_uniform_knots(degree + n, degree) for n in row) for row in self.spans.tolist()]
        return ControlNets(degree, tuple(knots), self.interfaces)  # type: ignore[arg-type]

    def straight(self, number: int) -> BSplineVolume:
        """Return a hexahedron with straight pieces as a spline of degree 1: bilinear across w."""
        points = self.points[self.sections(number)]
        knots = tuple(open_uniform_knots(count, 1) for count in points.shape[:3])
        return BSplineVolume((1, 1, 1), knots, points)  # type: ignore[arg-type]

    @property
    def body(self) -> Body:
        """Return all hexahedra with straight pieces as a body of degree 1."""
        return Body(tuple(map(self.straight, range(len(self)))), self.interfaces)


def _glued(faces: IntArray, vertices: IntArray) -> IntArray:
    """Return the pairs of faces that have the same vertices as rows (k, 7), see interface_rows.py.

    faces: (n,) numbers 6 * hexahedron + face. vertices: (n, a, b) of each. The second face has the larger number.
    """
    keys = np.sort(vertices.reshape(len(faces), -1), axis=1)
    order = np.lexsort((faces, *keys.T))
    alike = np.all(keys[order[1:]] == keys[order[:-1]], axis=1)
    begins = np.maximum.accumulate(np.where(alike, 0, np.arange(1, len(order))))  # where the run of each face begins
    pairs = 1 + np.flatnonzero((np.arange(1, len(order)) - begins) % 2 == 1)
    first, second = order[pairs - 1], order[pairs]
    rows = np.zeros((len(pairs), COLUMNS), dtype=np.int64)
    rows[:, :2], rows[:, 2:4] = (np.stack(np.divmod(faces[own], len(FACE_NAMES)), axis=1) for own in (first, second))
    below, above = (np.moveaxis(vertices[own], 0, 2) for own in (first, second))
    for way in reversed(list(orientations((0, "u0"), (0, "u0")))):  # of several ways the first remains
        turned = way.turned(above)
        if turned.shape == below.shape:
            rows[(turned == below).all(axis=(0, 1)), 4:] = way.swapped, *way.flipped
    return rows


class Vertices:
    """The points of a complex in the making."""

    def __init__(self, points: Iterable[Array] = ()) -> None:
        self._rows = list(points)

    def add(self, points: Array) -> IntArray:
        """Add points (..., 3), and return their numbers (...)."""
        first = len(self._rows)
        self._rows += list(points.reshape(-1, 3))
        return np.arange(first, len(self._rows)).reshape(points.shape[:-1])

    def __getitem__(self, number: int) -> Array:
        return self._rows[number]

    @property
    def array(self) -> Array:
        """Return all points (n, 3)."""
        return np.array(self._rows)


def spline_of(blocks: Complex, degree: int) -> SplineMap:
    """Return the map of a complex, equal at interfaces bit by bit, with uniform knots."""
    nets = blocks.nets(degree)
    curved = {number: _ruled(blocks, number, degree) for number, name in blocks.surfaces if name == "w0"}
    found = curved | _straight_nets(blocks, [number for number in range(len(blocks)) if number not in curved], degree)
    parts = [np.moveaxis(found[number], -1, 0) for number in range(len(blocks))]
    return SplineMap(nets, nets.merged(nets.joined(parts)))


def control_points(blocks: Complex, number: int, degree: int) -> Array:
    """Return the control points (n_u, n_v, n_w, 3) of a hexahedron with uniform knots.

    Between two surfaces it is ruled; else they are its points at the Greville points of the knots.
    """
    if (number, "w0") in blocks.surfaces:
        return _ruled(blocks, number, degree)
    return _straight_nets(blocks, [number], degree)[number]


def _ruled(blocks: Complex, number: int, degree: int) -> Array:
    """Return the control points (n_u, n_v, n_w, 3) of a hexahedron between two surfaces."""
    low, high = (blocks.surfaces[number, name] for name in ("w0", "w1"))
    share = _places(degree, blocks.spans[number, 2])[:, None]
    return np.asarray((1.0 - share) * low[:, :, None] + share * high[:, :, None])


def _straight_nets(blocks: Complex, numbers: Sequence[int], degree: int) -> dict[int, Array]:
    """Return the control points (n_u, n_v, n_w, 3) of some hexahedra with straight pieces, by their numbers."""
    found: dict[int, Array] = {}
    for group in groups_of([blocks.straight(number) for number in numbers]):
        own = np.asarray(numbers)[group.numbers]
        kinds, labels = np.unique(blocks.spans[own], axis=0, return_inverse=True)
        for label, spans in enumerate(kinds.tolist()):
            grid = np.meshgrid(*(_places(degree, n) for n in spans), indexing="ij")
            places, members = np.stack(grid, axis=-1), np.flatnonzero(labels.ravel() == label)
            where = np.tile(places.reshape(-1, 3), (len(members), 1))
            points = group.at(np.repeat(members, len(where) // len(members)), where)
            found |= zip(own[members].tolist(), points.reshape(-1, *places.shape), strict=True)
    return found


def _places(degree: int, spans: int) -> Array:
    """Return the Greville points of uniform knots."""
    return greville(open_uniform_knots(degree + spans, degree), degree)


def is_proved(body: Body) -> bool:
    """Return whether a body is certified and its boundary is proved not to meet itself."""
    return certify(body).verdict == "certified" and check_boundary(body).injective is True
