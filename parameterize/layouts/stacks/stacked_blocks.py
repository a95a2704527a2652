"""Makes the blocks of a stack of extrusions: columns over the quadrangles of its profiles, whose curves are splines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array, IntArray
from ...spline.bspline import greville
from ...spline.interface import Face
from ...spline.spline_map import SplineMap
from ...surface.features import SHARP
from ..complex import FEWEST_SPANS, MOST_BLOCKS, Complex, is_proved, spline_of
from ..planar.coons import Quad, coons_patch
from ..planar.decomposition import Decomposition, decomposition_of
from ..planar.lines import lines_of
from ..planar.planar_graph import Cutting, network_of
from ..planar.plane_curves import Chain, Curve, chains_of, deviation, fitted, needed_spans
from ..planar.plane_regions import PlaneRegion, regions_of
from ..planar.polygons import area_of, edges_of
from .stack import SAME, Stack, stack_of
from .tapers import tapered_stack_of

_GOOD = 0.3  # quality of a decomposition after which no other cutting is tried
_CUTTINGS = (Cutting(), Cutting(radial=True), Cutting(finer=2.0), Cutting(finer=2.0, facing=True))

_Regions = tuple[PlaneRegion, ...]


@dataclass(frozen=True, eq=False)
class StackedBlocks:
    """Blocks over a plane decomposition, between the heights of a stack.

    Attributes
    ----------
    blocks : Complex
    spline : SplineMap
    off : float
        How far the curves are from the outlines of the surface at most, over the diagonal of its box.
    """

    blocks: Complex
    spline: SplineMap
    off: float

    def __len__(self) -> int:
        return len(self.blocks)


def stacked_blocks(
    vertices: Array, faces: IntArray, spans: int, degree: int, most: int | None = None, sharp: float = SHARP
) -> StackedBlocks | None:
    """Return blocks that fill a stack of extrusions, and are proved to be one-to-one; None where there are none.

    vertices: (n, 3), faces: (m, 3), of a closed surface. spans: across a block that is a cube. most: blocks, at most.
    sharp: the angle in degrees above which outlines have a corner, and rims are those of a stack with leaning sides.
    """
    stack = stack_of(vertices, faces) or tapered_stack_of(vertices, faces, sharp)
    if stack is None:
        return None
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    limit = MOST_BLOCKS if most is None else min(most, MOST_BLOCKS)
    for plane, regions in sorted(_decompositions(stack, limit, sharp), key=lambda row: row[0].cost):
        made = _over(plane, regions, stack, spans, degree, diagonal)
        if is_proved(made.spline.body):
            return made
    return None


def _decompositions(stack: Stack, most: int, sharp: float) -> Iterator[tuple[Decomposition, _Regions]]:
    """Yield decompositions of the profiles, for `most` blocks or fewer that fill the body, until one is good."""
    lines = lines_of(stack.profiles, stack.near)
    if lines is None:
        return
    for corners, chains in _chains(*lines, sharp):
        for cutting in _CUTTINGS:
            network = network_of(lines[0][corners], chains, cutting)
            regions = regions_of(network, stack.profiles)
            plane = decomposition_of(network, regions, most, facing=cutting.facing) if regions else None
            if plane is None or not regions or not _fills(plane, regions, stack):
                continue
            plane = plane.smoothed()
            yield plane, regions
            if plane.quality > _GOOD:
                return


def _chains(points: Array, lines: IntArray, sharp: float) -> Iterator[tuple[list[int], list[Chain]]]:
    """Yield the corners and chains of outlines, first those with straight parts of smooth ones as chains of their own.

    A slot's sides are straight lines then; other outlines have these by chance, and may be divided better without them.
    """
    apart, whole = chains_of(points, lines, sharp, straight=True), chains_of(points, lines, sharp)
    yield apart
    if len(whole[0]) < len(apart[0]):
        yield whole


def _fills(plane: Decomposition, regions: _Regions, stack: Stack) -> bool:
    """Return whether blocks over quadrangles have a stack's volume, up to what lies between curves and their lines."""
    layers = np.array([np.diff(stack.heights)[list(region.solid)].sum() for region in regions])
    total = between = 0.0
    for quad, owner in zip(plane.quads, plane.owners, strict=True):
        curves = [plane.sides.get(edge) for edge in edges_of(quad)]
        rows = [c.samples if c is not None else plane.points[[k]] for c, k in zip(curves, quad, strict=True)]
        total += layers[owner] * area_of(np.concatenate(rows))
        between += layers[owner] * sum(_between(curve) for curve in curves if curve is not None)
    return abs(total - stack.volume) <= between + SAME * stack.volume


def _between(curve: Curve) -> float:
    """Return the area between a curve and its polygonal line."""
    return abs(area_of(np.concatenate([curve.samples, curve.points[::-1]])))


def _over(
    plane: Decomposition, regions: _Regions, stack: Stack, spans: int, degree: int, diagonal: float
) -> StackedBlocks:
    """Return the blocks over the quadrangles of a decomposition."""
    quads, layers = [], []
    for quad, owner in zip(plane.quads, plane.owners, strict=True):
        for layer in np.flatnonzero(regions[owner].solid).tolist():
            quads.append(quad)
            layers.append(layer)
    levels = [plane.moved(field) for field in stack.fields] or [plane] * len(stack.heights)
    straight = _straight(quads, layers, levels, stack)
    lengths, fewest = np.empty((len(quads), 3)), np.full((len(quads), 3), FEWEST_SPANS)
    needs = {edge: needed_spans(curve, degree, diagonal) for edge, curve in plane.sides.items() if edge[0] < edge[1]}
    lengths[:, 2] = np.diff(stack.heights)[layers]
    for k, (a, b, c, d) in enumerate(quads):
        for axis, pair in enumerate((((a, b), (d, c)), ((a, d), (b, c)))):
            lengths[k, axis] = np.mean([_length(plane, edge) for edge in pair])
            fewest[k, axis] = max(needs.get((min(edge), max(edge)), 1) for edge in pair)
    blocks = straight.with_even_spans(lengths, spans, fewest)
    surfaces, off = dict[Face, Array](), 0.0
    for k, (quad, layer, knots) in enumerate(zip(quads, layers, blocks.nets(degree).knots, strict=True)):
        ends = [_plane_net(levels[layer], quad, knots, degree)]
        ends += [ends[0] if stack.fields == () else _plane_net(levels[layer + 1], quad, knots, degree)]
        off = max(off, *(away for _, away in ends))
        for level, name, (net, _) in zip((layer, layer + 1), ("w0", "w1"), ends, strict=True):
            surfaces[k, name] = stack.in_space(net, level)
    blocks = replace(blocks, surfaces=surfaces)
    return StackedBlocks(blocks, spline_of(blocks, degree), off / diagonal)


def _straight(quads: Sequence[Quad], layers: Sequence[int], levels: Sequence[Decomposition], stack: Stack) -> Complex:
    """Return the blocks over quadrangles between two levels each, with straight edges.

    A point of the plane is a vertex at each level.
    """
    points = np.concatenate([stack.in_space(plane.points, level) for level, plane in enumerate(levels)])
    corners = np.array(quads)[:, [[0, 3], [1, 2]]]  # (k, 2, 2), [u][v]
    low = corners + len(levels[0].points) * np.array(layers)[:, None, None]
    return Complex(points, np.stack([low, low + len(levels[0].points)], axis=-1))


def _plane_net(plane: Decomposition, quad: Quad, knots: Sequence[Array], degree: int) -> tuple[Array, float]:
    """Return the control points (n_u, n_v, 2) over a quadrangle, and how far its sides are from their curves."""
    (a, b, c, d), off = quad, 0.0
    edges = ((a, b), (d, c), (a, d), (b, c))
    rows = [_side(plane, edge, knots[k // 2], degree) for k, edge in enumerate(edges)]
    for k, (edge, row) in enumerate(zip(edges, rows, strict=True)):
        if edge in plane.sides:
            off = max(off, deviation(plane.sides[edge], knots[k // 2], degree, row))
    low, high, left, right = rows
    u, v = (greville(row, degree) for row in knots[:2])
    return coons_patch(low, high, left, right, u, v), off


def _length(plane: Decomposition, edge: tuple[int, int]) -> float:
    curve = plane.sides.get(edge)
    return curve.length if curve is not None else float(np.linalg.norm(np.diff(plane.points[list(edge)], axis=0)))


def _side(plane: Decomposition, edge: tuple[int, int], knots: Array, degree: int) -> Array:
    """Return the control points (n, 2) of a side, the same in both directions."""
    curve = plane.sides.get(edge)
    if curve is None:
        share = greville(knots, degree)[:, None]
        return (1.0 - share) * plane.points[edge[0]] + share * plane.points[edge[1]]
    if edge[0] > edge[1]:
        return fitted(plane.sides[edge[::-1]], knots, degree)[::-1]
    return fitted(curve, knots, degree)
