"""Integrates on the images of faces of the cube whose parts end between knots, as regions do.

The faces of one name of many patches are cut at once, if the patches have equal degrees and knots. Every point has a
code, which says to which regions it belongs. A cell (at first a span) on which the code is constant has Gauss points.
Any other cell is cut into lines along one of its directions, the jumps of the code on each line are found by bisection,
and every piece between two jumps has Gauss points. Where all lines of a cell meet the rim in the same way, this is
exact to high order; where the rim ends or bends between lines, the cell is halved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, Floats, IntArray, Mask
from parameterize.spline.orientation import orientations
from parameterize.spline.patch_groups import PatchGroup, group_of
from parameterize.spline.spline_stack import VALUE, SplineStack
from parameterize.spline.volume import UNITS, BSplineVolume

from .space import TrialSpace

Codes = Callable[[Array, Array, IntArray], IntArray]  # of points (3, m), outward unit normals (3, m), and faces (m,)

SAMPLES = 5  # points a direction at which a cell's code is evaluated, its ends included
FEWEST = 120  # of these a direction on a face of a body of one cube, so that few spans are sampled as finely as many
PIECES = 8  # intervals of a line, each searched for a jump
BISECTIONS = 20
TOLERANCE = 1e-4  # share of the area of a face's regions by which it may be wrong
SPREAD = 0.05  # of a cell in which lines differ, its usual error; these are of either sign
HALVINGS = 8  # of such cells, at most
MOST_CELLS = 6000  # of one size on a face, of rims that are ragged as the triangles of a mesh are
POINTS = 2**16  # whose codes are evaluated at once


@dataclass(frozen=True, eq=False)
class Faces:
    """Hold the faces of one name of k patches of equal degrees and knots. hands: (k,), the orientations of the maps."""

    group: PatchGroup
    axis: int
    side: int
    hands: IntArray

    @classmethod
    def of(cls, group: PatchGroup, axis: int, side: int) -> "Faces":
        """Return the faces of a group."""
        return cls(group, axis, side, orientations(group))

    def rows(self, rows: IntArray) -> "Faces":
        """Return some of the faces."""
        return replace(self, group=self.group.rows(rows), hands=self.hands[rows])

    def __len__(self) -> int:
        return len(self.group)

    @cached_property
    def nets(self) -> Array:
        """Return the control points (k, n, 3)."""
        layer = np.take(self.group.control_points, -self.side, axis=1 + self.axis)
        return layer.reshape(len(self), -1, 3)

    @cached_property
    def surface(self) -> SplineStack:
        """Return the maps of the faces alone, constant across them."""
        group, keep = self.group, [-self.side]
        degrees = [0 if a == self.axis else p for a, p in enumerate(group.degrees)]
        knots = [np.array([0.0, 1.0]) if a == self.axis else row for a, row in enumerate(group.knots)]
        layer = np.take(group.coefficients, keep, axis=1 + self.axis)
        return SplineStack(tuple(degrees), tuple(knots), layer, group.weights is not None)  # type: ignore[arg-type]

    def parameters(self, across: Array) -> Array:
        """Return the parameters (m, 3) of points with parameters (m, 2) of the two directions along the faces."""
        return np.insert(across, self.axis, float(self.side), axis=1)

    def points(self, owners: IntArray, across: Array) -> Array:
        """Return the points (3, m) of the faces `owners` (m,)."""
        return np.ascontiguousarray(self.surface.at(owners, self.parameters(across)).T)

    def points_and_areas(self, owners: IntArray, across: Array) -> tuple[Array, Array]:
        """Return the points, and the outward normals (3, m), as long as the surface element."""
        orders = VALUE, UNITS[(self.axis + 1) % 3], UNITS[(self.axis + 2) % 3]
        x, first, second = self.surface.derivatives_at(owners, self.parameters(across), orders)
        signs = self.hands[owners] if self.side else -self.hands[owners]
        area = signs[:, None] * np.cross(first, second)
        return np.ascontiguousarray(x.T), np.ascontiguousarray(area.T)

    def jacobian(self, owners: IntArray, parameters: Array) -> Array:
        """Return the derivatives (m, 3, 3) of the maps."""
        return self.group.jacobian(owners, parameters)


@dataclass(frozen=True, eq=False)
class FacePoints:
    """Hold points of faces at parameters (m, 3), their images, and the maps' derivatives there.

    owners: (m,), the numbers of the faces. x, area: (3, m), the points in space, and the outward normals with the
    length of the surface element. jacobian: (m, 3, 3).
    """

    owners: IntArray
    parameters: Array
    x: Array
    area: Array
    jacobian: Array

    @classmethod
    def of(cls, faces: Faces, owners: IntArray, across: Array) -> "FacePoints":
        """Return the points with parameters (m, 2) of the two directions along the faces `owners` (m,)."""
        parameters = faces.parameters(across)
        x, area = faces.points_and_areas(owners, across)
        return cls(owners, parameters, x, area, faces.jacobian(owners, parameters))

    @property
    def size(self) -> Array:
        """Return the surface element (m,)."""
        return np.asarray(np.linalg.norm(self.area, axis=0))

    @property
    def normal(self) -> Array:
        """Return the outward unit normals (3, m), zero where the face shrinks to a point."""
        return _unit(self.area)


@dataclass(frozen=True, eq=False)
class SurfaceRule:
    """Hold points on faces, their weights (m,) in space and their codes (m,)."""

    at: FacePoints
    weights: Array
    codes: IntArray

    def part(self, chosen: IntArray) -> "SurfaceRule":
        """Return the chosen points."""
        at = self.at
        rows = at.owners[chosen], at.parameters[chosen]
        points = FacePoints(*rows, at.x[:, chosen], at.area[:, chosen], at.jacobian[chosen])
        return SurfaceRule(points, self.weights[chosen], self.codes[chosen])


def surface_rule(
    volume: BSplineVolume,
    space: TrialSpace,
    axis: int,
    side: int,
    codes: Codes,
    length: float | None = None,
    needs_normal: bool = True,
) -> SurfaceRule | None:
    """Return the rule of `surface_rules` for the face of one volume."""
    return surface_rules(Faces.of(group_of(volume), axis, side), space, codes, length, needs_normal)


def surface_rules(
    faces: Faces, space: TrialSpace, codes: Codes, length: float | None = None, needs_normal: bool = True
) -> SurfaceRule | None:
    """Return the rule of all faces, without the points whose code is zero; None where all codes are zero.

    space: that of all patches. needs_normal: whether codes depend on normals; others get zeros for them, in half of the
    time. length: the cube root of the body's volume; faces that are smaller, as those of many blocks, are looked at no
    more closely than those of one cube.

    Cells in which lines differ are halved until their usual error is within TOLERANCE of the area of the regions on
    their face. For a slab, the points are those of the whole face's rule that lie on its spans, so that they do not
    depend on the processes.
    """
    sizes = np.linalg.norm(np.ptp(faces.nets, axis=1), axis=1)
    shares = np.ones(len(faces)) if length is None else np.minimum(1.0, sizes / (np.sqrt(2.0) * length))
    fewest = np.ceil(shares * FEWEST).astype(np.int64)
    whole = _Cutter(faces, space.whole, codes, fewest, needs_normal).rule()
    if whole is None or space.whole is space:
        return whole
    u, (first, *_, last) = whole.at.parameters[:, 0], space.breaks[0]
    chosen = np.flatnonzero((u >= first) & (u <= last))
    return whole.part(chosen) if len(chosen) else None


@dataclass(frozen=True, eq=False)
class _Cells:
    """Hold cells of faces: the lower and upper ends (n, 2, 2) of both parameters, and the faces (n,)."""

    ends: Array
    owners: IntArray

    @classmethod
    def joined(cls, parts: Sequence["_Cells"]) -> "_Cells":
        """Return the cells of several parts as one."""
        return cls(np.concatenate([part.ends for part in parts]), np.concatenate([part.owners for part in parts]))

    def __len__(self) -> int:
        return len(self.ends)

    def __getitem__(self, chosen: Mask | IntArray) -> "_Cells":
        return _Cells(self.ends[chosen], self.owners[chosen])

    @property
    def sizes(self) -> Array:
        """Return the areas (n,) in the parameters."""
        return np.asarray(np.prod(self.ends[:, 1] - self.ends[:, 0], axis=-1))

    @property
    def are_whole(self) -> bool:
        """Return whether all cells are whole faces."""
        return bool((self.ends[:, 0] == 0.0).all() and (self.ends[:, 1] == 1.0).all())

    @property
    def quarters(self) -> "_Cells":
        """Return the four quarters of every cell."""
        ends = np.stack([self.ends[:, 0], self.ends.mean(axis=1), self.ends[:, 1]], axis=1)  # (n, 3, 2)
        parts = [
            np.stack([np.stack([ends[:, i + di, 0], ends[:, j + dj, 1]], -1) for di, dj in ((0, 0), (1, 1))], axis=1)
            for i in (0, 1)
            for j in (0, 1)
        ]
        return _Cells(np.concatenate(parts), np.tile(self.owners, 4))


@dataclass(frozen=True, eq=False)
class _Cutter:
    faces: Faces
    space: TrialSpace
    codes: Codes
    fewest: IntArray
    needs_normal: bool

    def rule(self) -> SurfaceRule | None:
        """Return the quadrature rule of the faces."""
        cells, parts, rims, covered = self._spans(), [], [], np.zeros(len(self.faces))
        a_direction = int((len(cells) // len(self.faces)) ** 0.5)
        samples = np.maximum(SAMPLES, -(-self.fewest // a_direction))
        for halvings in range(HALVINGS + 1):
            codes, constant = self._surveyed(cells, samples)
            parts.append(self._gauss(cells[constant], codes[constant]))
            covered += self._of_faces(cells, cells.sizes * (constant & (codes != 0)))
            cells = cells[~constant]
            bent = self._across_rims(cells) | (samples > SAMPLES)[cells.owners]  # lines would lose a small part
            sizes, is_least = cells.sizes, samples == SAMPLES
            error = SPREAD * np.sqrt(self._of_faces(cells, sizes**2 * bent))
            covered += 0.5 * self._of_faces(cells, sizes * ~bent)
            is_ended = is_least & (4 * self._of_faces(cells, 1.0 * bent) > MOST_CELLS) | (halvings == HALVINGS)
            is_ended |= error <= TOLERANCE * (covered + 0.5 * self._of_faces(cells, sizes * bent))
            on_lines = ~bent | is_ended[cells.owners]
            rims.append(cells[on_lines])
            cells, samples = cells[~on_lines].quarters, np.maximum(SAMPLES, samples // 2 + 1)  # as close as before
            if not len(cells):
                break
        parts.append(self._on_lines(_Cells.joined(rims)))
        found = [part for part in parts if part is not None]
        return _joined(found) if found else None

    def _of_faces(self, cells: _Cells, values: Floats) -> Array:
        """Return the sum (k,) over the cells of each face of values (n,)."""
        return np.bincount(cells.owners, values, len(self.faces)).astype(np.float64, copy=False)

    def _surveyed(self, cells: _Cells, samples: IntArray) -> tuple[IntArray, Mask]:
        """Return for cells the code (n,) of their first corner, and whether it holds all over the cell."""
        codes, constant = np.zeros(len(cells), dtype=np.int64), np.zeros(len(cells), dtype=bool)
        counts = samples[cells.owners]
        for count in np.unique(counts).tolist():
            own = np.flatnonzero(counts == count)
            seen = self._seen(cells[own], count)
            codes[own], constant[own] = seen[:, 0, 0], (seen == seen[:, :1, :1]).all(axis=(1, 2))
        return codes, constant

    def _across_rims(self, cells: _Cells) -> Mask:
        """Return the mask (n,) of the cells, all of them at rims, in which lines differ.

        Lines differ where a rim ends, bends or leaves the cell between two lines; otherwise the rule is exact to high
        order.
        """
        bent = np.zeros(len(cells), dtype=bool)
        for along, chosen in enumerate(self._directions(cells)):
            if len(chosen):
                t = _with_ends(_unit_rule(max(self.space.degrees) + 1)[0])
                grid = np.stack(np.meshgrid(np.linspace(0.0, 1.0, PIECES + 1), t, indexing="ij"), axis=-1)
                seen = self._on_grid(cells[chosen], grid if along == 0 else grid[..., ::-1])
                jumps = np.count_nonzero(np.diff(seen, axis=1), axis=1)
                marks = np.stack([seen[:, 0], seen[:, -1], jumps], axis=-1)
                bent[chosen] = (marks != marks[:, :1]).any(axis=(1, 2))
        return bent

    def _directions(self, cells: _Cells) -> tuple[IntArray, IntArray]:
        """Return the numbers of the cells whose codes jump more often along the first direction, and of the rest."""
        seen = self._seen(cells, SAMPLES)
        jumps = [np.count_nonzero(np.diff(seen, axis=1 + along), axis=(1, 2)) for along in (0, 1)]
        return np.flatnonzero(jumps[0] >= jumps[1]), np.flatnonzero(jumps[0] < jumps[1])

    def _spans(self) -> _Cells:
        """Return the spans of all faces."""
        b, c = (self.space.breaks[a] for a in range(3) if a != self.faces.axis)
        low = np.stack(np.meshgrid(b[:-1], c[:-1], indexing="ij"), axis=-1).reshape(-1, 2)
        high = np.stack(np.meshgrid(b[1:], c[1:], indexing="ij"), axis=-1).reshape(-1, 2)
        ends, count = np.stack([low, high], axis=1), len(self.faces)
        return _Cells(np.tile(ends, (count, 1, 1)), np.repeat(np.arange(count), len(ends)))

    def _code(self, owners: IntArray, across: Array) -> IntArray:
        """Return the codes (m,) of points with parameters (m, 2)."""
        found = np.empty(len(across), dtype=np.int64)
        for start in range(0, len(across), POINTS):
            here = slice(start, start + POINTS)
            where = owners[here], across[here]
            if self.needs_normal:
                x, area = self.faces.points_and_areas(*where)
                normal = _unit(area)
            else:
                x = self.faces.points(*where)
                normal = np.zeros_like(x)
            found[here] = self.codes(x, normal, owners[here])
        return found

    def _on_grid(self, cells: _Cells, grid: Array) -> IntArray:
        """Return the codes (n, a, b) of points at places (a, b, 2) of the unit square in each cell."""
        points = np.clip(_placed(cells.ends[:, None, None], grid), 0.0, 1.0)
        owners = np.repeat(cells.owners, grid.shape[0] * grid.shape[1])
        return self._code(owners, points.reshape(-1, 2)).reshape(points.shape[:3])

    def _seen(self, cells: _Cells, samples: int) -> IntArray:
        """Return the codes (n, samples + 2, samples + 2) of cells on grids that contain their ends.

        A grid extends one point beyond its cell, so that it finds a rim that bulges into the cell between two points.
        """
        step = 1.0 / (samples - 1)
        t = np.linspace(-step, 1.0 + step, samples + 2)
        if not cells.are_whole:
            return self._on_grid(cells, np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1))
        seen = self._on_grid(cells, np.stack(np.meshgrid(t[1:-1], t[1:-1], indexing="ij"), axis=-1))
        return np.pad(seen, ((0, 0), (1, 1), (1, 1)), mode="edge")  # there is nothing beyond a face

    def _gauss(self, cells: _Cells, codes: IntArray) -> SurfaceRule | None:
        """Return Gauss points on cells of one code each."""
        kept = codes != 0
        cells, codes = cells[kept], codes[kept]
        t, weights = _unit_rule(max(self.space.degrees) + 1)
        grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
        points = _placed(cells.ends[:, None], grid)
        return self._weighted(
            np.repeat(cells.owners, len(grid)),
            points.reshape(-1, 2),
            np.multiply.outer(cells.sizes, np.multiply.outer(weights, weights).ravel()).ravel(),
            np.repeat(codes, len(grid)),
        )

    def _weighted(self, owners: IntArray, across: Array, weights: Array, codes: IntArray) -> SurfaceRule | None:
        """Return a rule from weights in the parameters; None where all codes are zero."""
        if not len(across):
            return None
        at = FacePoints.of(self.faces, owners, across)
        return SurfaceRule(at, weights * at.size, codes)

    def _on_lines(self, cells: _Cells) -> SurfaceRule | None:
        """Return points on cells at a rim: they lie on lines in the direction in which the code jumps more often."""
        if not len(cells):
            return None
        t, weights = _unit_rule(max(self.space.degrees) + 1)
        low, size = (np.repeat(row, len(t), axis=0) for row in (cells.ends[:, 0], np.diff(cells.ends, axis=1)[:, 0]))
        owners, is_first = np.repeat(cells.owners, len(t)), np.zeros(len(cells), dtype=bool)
        is_first[self._directions(cells)[0]] = True
        is_first = np.repeat(is_first, len(t))
        fixed, line_weights = np.tile(t, len(cells)), np.tile(weights, len(cells))

        def codes(line: IntArray, s: Array) -> tuple[Array, IntArray]:
            first, other = is_first[line], fixed[line]
            places = np.stack([np.where(first, s, other), np.where(first, other, s)], axis=-1)
            across = low[line] + places * size[line]
            return across, self._code(owners[line], across)

        lines = np.arange(len(low))
        s = np.linspace(0.0, 1.0, PIECES + 1)
        seen = codes(np.repeat(lines, len(s)), np.tile(s, len(lines)))[1].reshape(len(lines), -1)
        line, piece = np.nonzero(np.diff(seen, axis=1))
        left, right, first = s[piece], s[piece + 1], seen[line, piece]
        for _ in range(BISECTIONS if len(line) else 0):
            middle = 0.5 * (left + right)
            same = codes(line, middle)[1] == first
            left, right = np.where(same, middle, left), np.where(same, right, middle)
        ends = np.concatenate([lines, line, lines]), np.concatenate([0.0 * lines, left, 0.0 * lines + 1.0])
        order = np.lexsort(ends[::-1])
        of_line, places = ends[0][order], ends[1][order]
        begins = np.flatnonzero(of_line[:-1] == of_line[1:])
        start, length, of_line = places[begins], np.diff(places)[begins], of_line[begins]
        across, found = codes(np.repeat(of_line, len(t)), (start[:, None] + np.multiply.outer(length, t)).ravel())
        each = np.multiply.outer(length * line_weights[of_line] * np.prod(size[of_line], axis=1), weights).ravel()
        middles = np.repeat(found.reshape(-1, len(t))[:, len(t) // 2], len(t))  # one code a piece
        kept = (middles != 0) & (each > 0.0)
        return self._weighted(np.repeat(owners[of_line], len(t))[kept], across[kept], each[kept], middles[kept])


def _placed(cells: Array, places: Array) -> Array:
    """Return points (.., 2) of cells (.., 2, 2) at places (.., 2) of the unit square."""
    return np.asarray(cells[..., 0, :] + places * (cells[..., 1, :] - cells[..., 0, :]))


def _unit_rule(count: int) -> tuple[Array, Array]:
    """Return `count` Gauss points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def _unit(rows: Array) -> Array:
    """Return vectors (3, m) of length 1 in place of those of any length; zero stays zero."""
    size = np.linalg.norm(rows, axis=0)
    return np.asarray(rows / np.where(size > 0.0, size, 1.0))


def _with_ends(t: Array) -> Array:
    return np.concatenate([[0.0], t, [1.0]])


def _joined(parts: Sequence[SurfaceRule]) -> SurfaceRule:
    """Return the points of several rules as one."""
    at = FacePoints(
        np.concatenate([part.at.owners for part in parts]),
        np.concatenate([part.at.parameters for part in parts]),
        np.concatenate([part.at.x for part in parts], axis=1),
        np.concatenate([part.at.area for part in parts], axis=1),
        np.concatenate([part.at.jacobian for part in parts]),
    )
    return SurfaceRule(
        at, np.concatenate([part.weights for part in parts]), np.concatenate([part.codes for part in parts])
    )
