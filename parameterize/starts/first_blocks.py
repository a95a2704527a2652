"""Makes the first map of a body of blocks: the thin rods of its layout, inside the solid."""

import numpy as np

from ..blocks.layout import Block, BlockLayout
from ..spline.bspline import greville, open_uniform_knots
from ..spline.nets import Nets
from ..spline.spline_map import SplineMap


def first_blocks(layout: BlockLayout, degree: int) -> SplineMap:
    """Return the map whose control points are points of the layout's rods, at the Greville points of uniform knots."""
    knots = [tuple(open_uniform_knots(degree + spans, degree) for spans in block.spans) for block in layout.blocks]
    nets = Nets(degree, tuple(knots), layout.interfaces)  # type: ignore[arg-type]
    parts = [_control_points(block, nets, k) for k, block in enumerate(layout.blocks)]
    return SplineMap(nets, nets.merged(nets.joined(parts)))


def _control_points(block: Block, nets: Nets, number: int) -> np.ndarray:
    rows = [greville(row, nets.degree) for row in nets.knots[number]]
    places = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    return np.moveaxis(block.points(places), -1, 0)
