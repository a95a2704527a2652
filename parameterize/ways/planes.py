"""The way to blocks that are exact, for a body whose surface is planes: nothing is left to optimise.

The blocks are trilinear, and a spline of any degree has them exactly. Each face of the body is made of whole faces of
blocks, and each of its edges of edges of blocks.
"""

from ..layouts.complex import Complex, spline_of
from ..layouts.planes.exact_blocks import exact_blocks
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from ..threads import one_blas_thread
from .laid import Laid, in_words
from .mapping_task import MappingTask
from .way import Suits


class BoundedByPlanes(Laid):
    """Make a map of exact blocks, which are found with their proof."""

    origin, why = "planes", Reason.EXACT
    comes_from = "exact blocks", "along the planes of the surface"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether planes bound the body, and divide it into few enough hexahedra."""
        blocks = _exact_blocks(task)
        if blocks is None:
            return Suits(False)
        return Suits(True, f"bounded by planes: {in_words(len(blocks), 'exact block')}")

    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map of exact blocks at volume 1."""
        blocks = _exact_blocks(task)
        assert blocks is not None, "the way suits the body"
        return spline_of(blocks, task.config.spline.degree)


PLANES = BoundedByPlanes("planes", "laying exact blocks along the planes")


def _exact_blocks(task: MappingTask) -> Complex | None:
    """Return exact blocks of a body that planes bound, at volume 1; None for others, and for given corners."""
    surface, spline, most = task.surface, task.config.spline, task.config.blocks
    if task.given_corners is not None or len(surface.crossings) or len(surface.solids) > 1:
        return None

    def find() -> Complex | None:
        with one_blas_thread():
            return exact_blocks(surface.to_unit(surface.vertices), surface.faces, most)

    if (blocks := task.fact(("planes", most), find)) is None:
        return None
    if len(blocks) > 1:
        return blocks.with_even_spans(blocks.lengths, task.spans_across)
    return blocks.with_spans(spline.control_points - spline.degree)
