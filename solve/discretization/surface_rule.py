"""Integrates on the image of a face of the cube whose parts end between knots, as regions do.

Every point has a code, which says to which regions it belongs. A cell (at first a span) on which the code is constant
has Gauss points. Any other cell is cut into lines along one of its directions, the jumps of the code on each line are
found by bisection, and every piece between two jumps has Gauss points. Where all lines of a cell meet the rim in the
same way, this is exact to high order; where the rim ends or bends between lines, the cell is halved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array, IntArray
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume

from .space import TrialSpace

Mask = NDArray[np.bool_]
Codes = Callable[[Array, Array], IntArray]  # of points (3, m) and outward unit normals (3, m)

SAMPLES = 5  # points a direction at which a cell's code is evaluated, its ends included
FEWEST = 120  # of these a direction on a face of a body of one cube, so that few spans are sampled as finely as many
PIECES = 8  # intervals of a line, each searched for a jump
BISECTIONS = 20
TOLERANCE = 1e-4  # share of the area of a face's regions by which it may be wrong
SPREAD = 0.05  # of a cell in which lines differ, its usual error; these are of either sign
HALVINGS = 8  # of such cells, at most
MOST_CELLS = 6000  # of one size, of rims that are ragged as the triangles of a mesh are


@dataclass(frozen=True, eq=False)
class FacePoints:
    """Hold points of a face at parameters (m, 3), their images, and the map's derivatives there.

    x, area: (3, m), the points in space, and the outward normals with the length of the surface element. jacobian: (m,
    3, 3).
    """

    parameters: Array
    x: Array
    area: Array
    jacobian: Array

    @classmethod
    def of(cls, volume: BSplineVolume, hand: int, axis: int, side: int, across: Array) -> "FacePoints":
        """Return the points with parameters (m, 2) of the two directions along a face; hand: the orientation."""
        parameters = np.insert(across, axis, float(side), axis=1)
        jacobian = volume.jacobian(parameters)
        area = np.cross(jacobian[..., (axis + 1) % 3], jacobian[..., (axis + 2) % 3]).T
        return cls(parameters, volume(parameters).T, (hand if side else -hand) * area, jacobian)

    @property
    def size(self) -> Array:
        """Return the surface element (m,)."""
        return np.asarray(np.linalg.norm(self.area, axis=0))

    @property
    def normal(self) -> Array:
        """Return the outward unit normals (3, m), zero where the face shrinks to a point."""
        size = self.size
        return np.asarray(self.area / np.where(size > 0.0, size, 1.0))


@dataclass(frozen=True, eq=False)
class SurfaceRule:
    """Hold points on a face, their weights (m,) in space and their codes (m,)."""

    at: FacePoints
    weights: Array
    codes: IntArray


def surface_rule(
    volume: BSplineVolume,
    space: TrialSpace,
    axis: int,
    side: int,
    codes: Codes,
    length: float | None = None,
    needs_normal: bool = True,
) -> SurfaceRule | None:
    """Return the rule of a face, without the points whose code is zero; None where all codes are zero.

    needs_normal: whether codes depend on normals; others get zeros for them, in a third of the time.

    length: the cube root of the body's volume; faces that are smaller, as those of many blocks, are looked at no more
    closely than those of one cube.

    Cells in which lines differ are halved until their usual error is within TOLERANCE of the regions' area. For a slab,
    the points are those of the whole face's rule that lie on its spans, so that they do not depend on the processes.
    """
    size = float(np.linalg.norm(np.ptp(volume.face(axis, side).reshape(-1, 3), axis=0)))
    share = 1.0 if length is None else min(1.0, size / (np.sqrt(2.0) * length))
    fewest = int(np.ceil(share * FEWEST))
    whole = _Cutter(volume, space.whole, axis, side, codes, fewest, needs_normal).rule()
    if whole is None or space.whole is space:
        return whole
    u, (first, *_, last) = whole.at.parameters[:, 0], space.breaks[0]
    return _part(whole, np.flatnonzero((u >= first) & (u <= last)))


@dataclass(frozen=True, eq=False)
class _Cutter:
    volume: BSplineVolume
    space: TrialSpace
    axis: int
    side: int
    codes: Codes
    fewest: int
    needs_normal: bool

    @cached_property
    def hand(self) -> int:
        """Return the orientation of the map."""
        return orientation(self.volume)

    def rule(self) -> SurfaceRule | None:
        """Return the quadrature rule of the face."""
        cells, parts, covered = self._spans(), [], 0.0
        samples = max(SAMPLES, -(-self.fewest // int(len(cells) ** 0.5)))
        for halvings in range(HALVINGS + 1):
            seen = self._seen(cells, samples)
            constant = (seen == seen[:, :1, :1]).all(axis=(1, 2))
            parts.append(self._gauss(cells[constant], seen[constant, 0, 0]))
            covered += float(_sizes(cells[constant & (seen[:, 0, 0] != 0)]).sum())
            cells, is_bent = self._across_rims(cells[~constant])
            is_bent |= samples > SAMPLES  # lines would lose a small part that is seen
            sizes = _sizes(cells)
            error = SPREAD * float(np.linalg.norm(sizes[is_bent]))
            covered += 0.5 * float(sizes[~is_bent].sum())
            is_last = halvings == HALVINGS or samples == SAMPLES and 4 * np.count_nonzero(is_bent) > MOST_CELLS
            if is_last or error <= TOLERANCE * (covered + 0.5 * float(sizes[is_bent].sum())):
                parts.append(self._on_lines(cells))
                break
            parts.append(self._on_lines(cells[~is_bent]))
            cells, samples = _quartered(cells[is_bent]), max(SAMPLES, samples // 2 + 1)  # as close together as before
        found = [part for part in parts if part is not None]
        return _joined(found) if found else None

    def _across_rims(self, cells: Array) -> tuple[Array, Mask]:
        """Return the cells at rims, and the mask of the cells in which lines differ.

        Cells with lines in the first direction come first. Lines differ where a rim ends, bends or leaves the cell
        between two lines; otherwise the rule is exact to high order.
        """
        if not len(cells):
            return cells, np.zeros(0, dtype=bool)
        bent = np.zeros(len(cells), dtype=bool)
        for along, chosen in enumerate(self._directions(cells)):
            if len(chosen):
                t = _with_ends(_unit_rule(max(self.space.degrees) + 1)[0])
                grid = np.stack(np.meshgrid(np.linspace(0.0, 1.0, PIECES + 1), t, indexing="ij"), axis=-1)
                points = _placed(cells[chosen][:, None, None], grid if along == 0 else grid[..., ::-1])
                seen = self._code(points.reshape(-1, 2)).reshape(points.shape[:3])
                jumps = np.count_nonzero(np.diff(seen, axis=1), axis=1)
                marks = np.stack([seen[:, 0], seen[:, -1], jumps], axis=-1)
                bent[chosen] = (marks != marks[:, :1]).any(axis=(1, 2))
        return cells, bent

    def _directions(self, cells: Array) -> tuple[IntArray, IntArray]:
        """Return the numbers of the cells whose codes jump more often along the first direction, and of the rest."""
        seen = self._seen(cells, SAMPLES)
        jumps = [np.count_nonzero(np.diff(seen, axis=1 + along), axis=(1, 2)) for along in (0, 1)]
        return np.flatnonzero(jumps[0] >= jumps[1]), np.flatnonzero(jumps[0] < jumps[1])

    def _spans(self) -> Array:
        """Return the spans of the face as cells (k, 2, 2): lower and upper ends of both directions."""
        b, c = (self.space.breaks[a] for a in range(3) if a != self.axis)
        low = np.stack(np.meshgrid(b[:-1], c[:-1], indexing="ij"), axis=-1).reshape(-1, 2)
        high = np.stack(np.meshgrid(b[1:], c[1:], indexing="ij"), axis=-1).reshape(-1, 2)
        return np.stack([low, high], axis=1)

    def _code(self, across: Array) -> IntArray:
        """Return the codes (m,) of points with parameters (m, 2)."""
        if self.needs_normal:
            at = FacePoints.of(self.volume, self.hand, self.axis, self.side, across)
            return self.codes(at.x, at.normal)
        x = self.volume(np.insert(across, self.axis, float(self.side), axis=1)).T
        return self.codes(x, np.zeros_like(x))

    def _seen(self, cells: Array, samples: int) -> IntArray:
        """Return the codes (k, samples + 2, samples + 2) of cells on grids that contain their ends.

        A grid extends one point beyond its cell, so that it finds a rim that bulges into the cell between two points.
        """
        step = 1.0 / (samples - 1)
        t = np.linspace(-step, 1.0 + step, samples + 2)
        grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1)
        points = np.clip(_placed(cells[:, None, None], grid), 0.0, 1.0)
        return self._code(points.reshape(-1, 2)).reshape(points.shape[:3])

    def _gauss(self, cells: Array, codes: IntArray) -> SurfaceRule | None:
        """Return Gauss points on cells of one code each."""
        kept = codes != 0
        t, weights = _unit_rule(max(self.space.degrees) + 1)
        grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
        points = _placed(cells[kept, None], grid)
        size = np.prod(cells[kept, 1] - cells[kept, 0], axis=-1)
        return self._weighted(
            points.reshape(-1, 2),
            np.multiply.outer(size, np.multiply.outer(weights, weights).ravel()).ravel(),
            np.repeat(codes[kept], len(grid)),
        )

    def _weighted(self, across: Array, weights: Array, codes: IntArray) -> SurfaceRule | None:
        """Return a rule from weights in the parameters; None where all codes are zero."""
        if not len(across):
            return None
        at = FacePoints.of(self.volume, self.hand, self.axis, self.side, across)
        return SurfaceRule(at, weights * at.size, codes)

    def _on_lines(self, cells: Array) -> SurfaceRule | None:
        """Return points on cells at a rim: they lie on lines in the direction in which the code jumps more often."""
        if not len(cells):
            return None
        parts = [self._lines_along(cells[chosen], along) for along, chosen in enumerate(self._directions(cells))]
        found = [part for part in parts if part is not None]
        return _joined(found) if found else None

    def _lines_along(self, cells: Array, along: int) -> SurfaceRule | None:
        """Return points on lines of one direction through cells."""
        if not len(cells):
            return None
        t, weights = _unit_rule(max(self.space.degrees) + 1)
        low, size = np.repeat(cells[:, 0], len(t), axis=0), np.repeat(cells[:, 1] - cells[:, 0], len(t), axis=0)
        fixed, line_weights = np.tile(t, len(cells)), np.tile(weights, len(cells))

        def codes(line: IntArray, s: Array) -> tuple[Array, IntArray]:
            places = np.empty((len(s), 2))
            places[:, along], places[:, 1 - along] = s, fixed[line]
            across = low[line] + places * size[line]
            return across, self._code(across)

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
        return self._weighted(across[kept], each[kept], middles[kept])


def _placed(cells: Array, places: Array) -> Array:
    """Return points (.., 2) of cells (.., 2, 2) at places (.., 2) of the unit square."""
    return np.asarray(cells[..., 0, :] + places * (cells[..., 1, :] - cells[..., 0, :]))


def _unit_rule(count: int) -> tuple[Array, Array]:
    """Return `count` Gauss points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def _quartered(cells: Array) -> Array:
    """Return the four quarters of every cell."""
    middle = cells.mean(axis=1)
    ends = np.stack([cells[:, 0], middle, cells[:, 1]], axis=1)  # (k, 3, 2)
    parts = [
        np.stack([np.stack([ends[:, i + di, 0], ends[:, j + dj, 1]], axis=-1) for di, dj in ((0, 0), (1, 1))], axis=1)
        for i in (0, 1)
        for j in (0, 1)
    ]
    return np.concatenate(parts)


def _sizes(cells: Array) -> Array:
    """Return the areas (k,) of cells in the parameters."""
    return np.asarray(np.prod(cells[:, 1] - cells[:, 0], axis=-1))


def _with_ends(t: Array) -> Array:
    return np.concatenate([[0.0], t, [1.0]])


def _part(rule: SurfaceRule, chosen: IntArray) -> SurfaceRule | None:
    """Return the chosen points of a rule; None where there are none."""
    if not len(chosen):
        return None
    at = rule.at
    points = FacePoints(at.parameters[chosen], at.x[:, chosen], at.area[:, chosen], at.jacobian[chosen])
    return SurfaceRule(points, rule.weights[chosen], rule.codes[chosen])


def _joined(parts: Sequence[SurfaceRule]) -> SurfaceRule:
    """Return the points of several rules as one."""
    at = FacePoints(
        np.concatenate([part.at.parameters for part in parts]),
        np.concatenate([part.at.x for part in parts], axis=1),
        np.concatenate([part.at.area for part in parts], axis=1),
        np.concatenate([part.at.jacobian for part in parts]),
    )
    return SurfaceRule(
        at, np.concatenate([part.weights for part in parts]), np.concatenate([part.codes for part in parts])
    )
