"""The way to blocks over the profiles of a stack of extrusions, which are left as they are."""

from ..layouts.stacks.stacked_blocks import StackedBlocks, stacked_blocks
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from .laid import Laid, in_words
from .mapping_task import MappingTask
from .way import Suits


class StackOfExtrusions(Laid):
    """Make a map of blocks over the profiles, which are found with their proof."""

    origin, why = "stacks", Reason.LAID
    comes_from = "blocks", "along the outlines of extrusions"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body is a stack of extrusions, and its profiles are divided into few enough blocks."""
        blocks = _stacked_blocks(task)
        if blocks is None:
            return Suits(False)
        off = f"within {blocks.off:.1e} of its outlines (over diagonal)"
        return Suits(True, f"a stack of extrusions: {in_words(len(blocks), 'block')}, {off}")

    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map of the stacked blocks at volume 1."""
        blocks = _stacked_blocks(task)
        assert blocks is not None, "the way suits the body"
        return blocks.spline


STACKS = StackOfExtrusions("stacks", "laying blocks along the outlines of extrusions")


def _stacked_blocks(task: MappingTask) -> StackedBlocks | None:
    """Return blocks of a stack of extrusions, at volume 1; None for other bodies, and for given corners."""
    surface, most = task.surface, task.config.blocks
    if task.given_corners is not None or len(surface.crossings) or len(surface.solids) > 1:
        return None
    options = task.spans_across, task.config.spline.degree, most, surface.sharp

    def find() -> StackedBlocks | None:
        return stacked_blocks(surface.to_unit(surface.vertices), surface.faces, *options)

    return task.fact(("stacks", *options), find)
