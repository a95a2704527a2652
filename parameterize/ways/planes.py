"""The way to blocks that are exact, for a body whose surface is planes: nothing is left to optimise.

The blocks are trilinear, and a spline of any degree has them exactly. Each face of the body is made of whole faces of
blocks, and each of its edges of edges of blocks.
"""

from dataclasses import replace

from ..layouts.planes.exact_blocks import division_of, layout_of
from ..layouts.rods.along_skeleton import BlockLayout
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from .blocks import thin_blocks
from .laid import Laid, in_words
from .task import MappingTask
from .way import Suits


class BoundedByPlanes(Laid):
    """Make a map of exact blocks, which are found with their proof."""

    origin, why = "planes", Reason.EXACT
    comes_from = "exact blocks", "along the planes of the surface"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether planes bound the body, and divide it into few enough hexahedra."""
        layout = _exact_blocks(task)
        return (
            Suits(False)
            if layout is None
            else Suits(True, f"bounded by planes: {in_words(len(layout), 'exact block')}")
        )

    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map of exact blocks at volume 1."""
        layout = _exact_blocks(task)
        assert layout is not None, "the way suits the body"
        return thin_blocks(layout, task.config.spline.degree)


PLANES = BoundedByPlanes("planes", "laying exact blocks along the planes")


def _exact_blocks(task: MappingTask) -> BlockLayout | None:
    """Return exact blocks of a body that planes bound, at volume 1; None for others, and for given corners."""
    spline = task.config.spline
    if task.given_corners is not None or (hexahedra := division_of(task.surface, task.config.blocks)) is None:
        return None
    layout = layout_of(hexahedra, task.spans_across)
    if len(layout) > 1:
        return layout
    spans = spline.control_points - spline.degree
    return BlockLayout((replace(layout.blocks[0], spans=(spans, spans, spans)),), ())
