"""Makes the blocks of a stack of extrusions: columns over the quadrangles of its profiles, whose curves are splines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array, IntArray
from ...certificate.body import certify
from ...certificate.boundary import check_boundary
from ...spline.bspline import greville, open_uniform_knots
from ...spline.spline_map import ControlNets, SplineMap
from ...surface.features import SHARP
from ..planes.exact_blocks import FEWEST_SPANS, MOST_BLOCKS, balanced_spans
from ..rods.along_skeleton import Block, BlockLayout
from .coons import Quad
from .curves import Chain, Curve, chains_of
from .division import Division, division_of
from .fit import deviation, fitted, needed_spans
from .lines import lines_of
from .planar_graph import Cutting, network_of
from .regions import PlaneRegion, regions_of
from .stack import SAME, Stack, area_of, stack_of
from .tapers import tapered_stack_of

_GOOD = 0.3  # quality of a division after which no other cutting is tried
_CUTTINGS = (Cutting(), Cutting(radial=True), Cutting(finer=2.0), Cutting(finer=2.0, facing=True))


@dataclass(frozen=True, eq=False)
class Columns:
    """Blocks over a plane division, between the heights of a stack.

    Attributes
    ----------
    layout : BlockLayout
        The blocks with straight edges, and their spans.
    spline : SplineMap
        With the curves.
    off : float
        How far the curves are from the outlines of the surface at most, over the diagonal of its box.
    """

    layout: BlockLayout
    spline: SplineMap
    off: float

    def __len__(self) -> int:
        return len(self.layout)


def columns_of(
    vertices: Array, faces: IntArray, spans: int, degree: int, most: int | None = None, sharp: float = SHARP
) -> Columns | None:
    """Return blocks that fill a stack of extrusions, and are proved to be one-to-one; None where there are none.

    vertices: (n, 3), faces: (m, 3), of a closed surface. spans: across a block that is a cube. most: blocks, at most.
    sharp: the angle in degrees above which outlines have a corner, and rims are those of a stack with leaning sides.
    """
    stack = stack_of(vertices, faces) or tapered_stack_of(vertices, faces, sharp)
    if stack is None:
        return None
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    limit = MOST_BLOCKS if most is None else min(most, MOST_BLOCKS)
    found = list(_divisions(stack, limit, sharp))
    for division, regions in sorted(found, key=lambda row: row[0].cost):
        columns = _columns(division, regions, stack, spans, degree, diagonal)
        if _is_proved(columns.spline):
            return columns
    return None


def _divisions(stack: Stack, most: int, sharp: float) -> Iterator[tuple[Division, tuple[PlaneRegion, ...]]]:
    """Yield divisions of the profiles into columns, `most` blocks or fewer, that fill the body, until one is good."""
    lines = lines_of(stack)
    if lines is None:
        return
    for corners, chains in _chains(*lines, sharp):
        for cutting in _CUTTINGS:
            network = network_of(lines[0][corners], chains, cutting)
            regions = regions_of(network, stack)
            division = division_of(network, regions, most, facing=cutting.facing) if regions else None
            if division is None or not regions or not _fills(division, regions, stack):
                continue
            division = division.smoothed()
            yield division, regions
            if division.quality > _GOOD:
                return


def _chains(points: Array, lines: IntArray, sharp: float) -> Iterator[tuple[list[int], list[Chain]]]:
    """Yield the corners and chains of outlines, first those with straight parts of smooth ones as chains of their own.

    A slot's sides are straight lines then; other outlines have these by chance, and may be divided better without them.
    """
    apart, whole = chains_of(points, lines, sharp, straight=True), chains_of(points, lines, sharp)
    yield apart
    if len(whole[0]) < len(apart[0]):
        yield whole


def _fills(division: Division, regions: tuple[PlaneRegion, ...], stack: Stack) -> bool:
    """Return whether columns over quadrangles have a stack's volume, up to what lies between curves and their lines."""
    layers = np.array([np.diff(stack.heights)[list(region.solid)].sum() for region in regions])
    total = between = 0.0
    for (a, b, c, d), owner in zip(division.quads, division.owners, strict=True):
        curves = [division.sides.get(edge) for edge in ((a, b), (b, c), (c, d), (d, a))]
        rows = [c.samples if c is not None else division.points[[k]] for c, k in zip(curves, (a, b, c, d), strict=True)]
        total += layers[owner] * area_of(np.concatenate(rows))
        between += layers[owner] * sum(_between(curve) for curve in curves if curve is not None)
    return abs(total - stack.volume) <= between + SAME * stack.volume


def _between(curve: Curve) -> float:
    """Return the area between a curve and its polygonal line."""
    return abs(area_of(np.concatenate([curve.samples, curve.points[::-1]])))


def _columns(
    division: Division, regions: tuple[PlaneRegion, ...], stack: Stack, spans: int, degree: int, diagonal: float
) -> Columns:
    """Return the blocks over the quadrangles of a division."""
    plan = [
        (quad, layer)
        for quad, owner in zip(division.quads, division.owners, strict=True)
        for layer in np.flatnonzero(regions[owner].solid).tolist()
    ]
    levels = [division.moved(field) for field in stack.fields] or [division] * len(stack.heights)
    blocks = [_block(k, levels, stack, *one, (1, 1, 1)) for k, one in enumerate(plan)]
    plain = BlockLayout.from_blocks(blocks)
    lengths, fewest = np.empty((len(plan), 3)), np.full((len(plan), 3), FEWEST_SPANS)
    needs = {edge: needed_spans(curve, degree, diagonal) for edge, curve in division.sides.items() if edge[0] < edge[1]}
    for k, ((a, b, c, d), layer) in enumerate(plan):
        lengths[k, 2] = stack.heights[layer + 1] - stack.heights[layer]
        for axis, pair in enumerate((((a, b), (d, c)), ((a, d), (b, c)))):
            lengths[k, axis] = np.mean([_length(division, edge) for edge in pair])
            fewest[k, axis] = max(needs.get((min(edge), max(edge)), 1) for edge in pair)
    counts = balanced_spans(plain, lengths, spans, fewest)
    layout = replace(
        plain, blocks=tuple(replace(one, spans=tuple(row)) for one, row in zip(blocks, counts.tolist(), strict=True))
    )
    knots = tuple(tuple(open_uniform_knots(degree + n, degree) for n in row) for row in counts.tolist())
    nets = ControlNets(degree, knots, plain.interfaces)  # type: ignore[arg-type]
    parts, off = [], 0.0
    for (quad, layer), own in zip(plan, knots, strict=True):
        ends = [_plane_net(levels[layer], quad, own, degree)]
        ends += [ends[0] if stack.fields == () else _plane_net(levels[layer + 1], quad, own, degree)]
        off = max(off, *(away for _, away in ends))
        low, high = (
            net @ stack.frame[:2] + stack.heights[k] * stack.frame[2] for k, (net, _) in enumerate(ends, layer)
        )
        share = greville(own[2], degree)[:, None]
        parts.append(np.moveaxis((1.0 - share) * low[:, :, None] + share * high[:, :, None], -1, 0))
    return Columns(layout, SplineMap(nets, nets.merged(nets.joined(parts))), off / diagonal)


def _plane_net(division: Division, quad: Quad, knots: Sequence[Array], degree: int) -> tuple[Array, float]:
    """Return the control points (n_u, n_v, 2) over a quadrangle, and how far its sides are from their curves."""
    (a, b, c, d), off = quad, 0.0
    edges = ((a, b), (d, c), (a, d), (b, c))
    rows = [_side(division, edge, knots[k // 2], degree) for k, edge in enumerate(edges)]
    for k, (edge, row) in enumerate(zip(edges, rows, strict=True)):
        if edge in division.sides:
            off = max(off, deviation(division.sides[edge], knots[k // 2], degree, row))
    return _coons(rows, *(greville(row, degree) for row in knots[:2])), off


def _block(
    number: int,
    levels: Sequence[Division],
    stack: Stack,
    quad: tuple[int, ...],
    layer: int,
    spans: tuple[int, int, int],
) -> Block:
    """Return the column over a quadrangle between two heights, with straight edges."""
    sections = []
    for k in (layer, layer + 1):
        a, b, c, d = levels[k].points[list(quad)] @ stack.frame[:2]
        sections.append(np.array([[a, d], [b, c]]) + stack.heights[k] * stack.frame[2])
    return Block(f"column {number}", np.stack(sections), spans)


def _length(division: Division, edge: tuple[int, int]) -> float:
    curve = division.sides.get(edge)
    return curve.length if curve is not None else float(np.linalg.norm(np.diff(division.points[list(edge)], axis=0)))


def _side(division: Division, edge: tuple[int, int], knots: Array, degree: int) -> Array:
    """Return the control points (n, 2) of a side, the same in both directions."""
    curve = division.sides.get(edge)
    if curve is None:
        share = greville(knots, degree)[:, None]
        return (1.0 - share) * division.points[edge[0]] + share * division.points[edge[1]]
    if edge[0] > edge[1]:
        return fitted(division.sides[edge[::-1]], knots, degree)[::-1]
    return fitted(curve, knots, degree)


def _coons(rows: list[Array], u: Array, v: Array) -> Array:
    """Return the control points (n_u, n_v, 2) of a Coons patch between those of v = 0, v = 1, u = 0 and u = 1."""
    low, high, left, right = rows
    s, t = u[:, None, None], v[None, :, None]
    ruled = (1 - t) * low[:, None] + t * high[:, None] + (1 - s) * left[None] + s * right[None]
    return ruled - (1 - s) * ((1 - t) * low[0] + t * high[0]) - s * ((1 - t) * low[-1] + t * high[-1])


def _is_proved(spline: SplineMap) -> bool:
    """Return whether blocks are certified and their boundary is proved not to meet itself."""
    return certify(spline.body).verdict == "certified" and check_boundary(spline.body).injective is True
