"""Starts from blocks that are exact, for a body whose surface is planes: nothing is left to optimise.

The blocks are trilinear, and a spline of any degree has them exactly. Each face of the body is made of whole faces of
blocks, and each of its edges of edges of blocks.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ..checkpoint import Checkpoints
from ..cube.boundary_map import on_faces
from ..optimization.certified_map import CertifiedMap
from ..optimization.endings import Course, Reason
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import TANGENTIAL, Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..quality.distances import nearest_on_boundary
from ..spline.sampled_boundary import SampledBoundary
from ..spline.spline_map import SplineMap
from ..spline.volume import FACE_NAMES
from ..surface.geometry import vertex_quadrics, vertex_weights
from ..threads import one_blas_thread
from .blocks import thin_blocks
from .kept_blocks import kept_blocks
from .start import Attempt, Start, Task


@dataclass(frozen=True)
class BoundedByPlanes(Start):
    """Make a map of exact blocks, which is certified and left as it is."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt:
        """Return the attempt whose map is the task's exact layout, which a checkpoint keeps."""

        def lay() -> SplineMap:
            assert task.exact is not None, "this start follows where the choice is planes"
            return thin_blocks(task.exact, task.config.spline.degree)

        return kept(task, kept_blocks(checkpoints, task.choice, lay), Reason.EXACT)


PLANES = BoundedByPlanes("planes", "planes", "laying exact blocks along the planes")


def kept(task: Task, first: SplineMap, why: Reason) -> Attempt:
    """Return the attempt whose map is left as it is made, and why."""
    with timed(task.seconds, "fit"), one_blas_thread():
        fit = _surface_fit(task, first)
    with timed(task.seconds, "optimize"), one_blas_thread():
        found = CertifiedMap.of(first)
    return Attempt(found, Course(Counter(), {}, why), fit, Weights())


def _surface_fit(task: Task, first: SplineMap) -> Correspondence:
    """Return the surface's vertices with their places on the blocks, in double precision."""
    points, faces = task.surface.to_unit(task.surface.vertices), task.surface.faces
    body = first.body
    patches, parameters, _ = nearest_on_boundary(points, body, SampledBoundary.of(body))
    outer = np.array([[name in names for name in FACE_NAMES] for names in body.outer])
    owners = 6 * patches + np.argmax(on_faces(parameters) & outer[patches], axis=1)
    return Correspondence(
        SlidingParameters(first.nets, parameters, owners, faces),
        points,
        vertex_quadrics(points, faces, TANGENTIAL),
        vertex_weights(points, faces, task.own),
    )
