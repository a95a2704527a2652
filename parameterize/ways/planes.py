"""The way to blocks that are exact, for a body whose surface is planes: nothing is left to optimise.

The blocks are trilinear, and a spline of any degree has them exactly. Each face of the body is made of whole faces of
blocks, and each of its edges of edges of blocks.
"""

from dataclasses import replace

from ..layouts.complex import Complex, spline_of
from ..layouts.planes.exact_blocks import exact_blocks
from ..optimization.endings import CertifiedMap, Reason
from ..spline.bspline import open_uniform_knots
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

    def certified(self, first: SplineMap) -> CertifiedMap:
        """Return the map with the certificate of its blocks by their corners: further knots leave them as they are."""
        return replace(CertifiedMap.of(_by_corners(first)), spline=first)


PLANES = BoundedByPlanes("planes", "laying exact blocks along the planes")


def _by_corners(first: SplineMap) -> SplineMap:
    """Return a map of trilinear blocks by the corners of each, as one span."""
    nets = first.nets
    fewer = replace(nets, degree=1, knots=((open_uniform_knots(2, 1),) * 3,) * len(nets.knots))
    blocks = (nets.of_block(first.control, block) for block in range(len(nets.knots)))
    return SplineMap(
        fewer, fewer.joined([net[:, :: n - 1, :: m - 1, :: k - 1] for net in blocks for n, m, k in [net.shape[1:]]])
    )


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
