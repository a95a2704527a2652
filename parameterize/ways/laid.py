"""What ways have in common whose blocks are left as they are laid, and the checkpoint of blocks that are laid."""

from abc import abstractmethod
from collections import Counter
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..checkpoint import Checkpoints
from ..cube.boundary_map import on_faces
from ..optimization.endings import CertifiedMap, Course, Reason
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..quality.distances import nearest_on_boundary
from ..spline.interface_rows import interfaces_of, rows_of
from ..spline.sampled_boundary import SampledBoundary
from ..spline.solids import PatchSolids
from ..spline.spline_map import ControlNets, SplineMap
from ..spline.volume import FACE_NAMES
from ..threads import one_blas_thread
from .cost import Cost
from .mapping_task import MappingTask
from .way import Attempt, Way

_CHECKPOINT = "first"
_SAMPLES = 80  # a direction of a face: the nearest points are found closely afterwards


class Laid(Way):
    """Make a map of blocks that are proved before the way suits: it is certified and left as it is."""

    why: ClassVar[Reason]  # of its end

    @abstractmethod
    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map at volume 1 of a body that the way suits."""

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt:
        """Return the attempt whose map is left as it is laid, which a checkpoint keeps."""
        with timed(task.seconds, "fit"), one_blas_thread():
            first = kept_blocks(checkpoints, lambda: self._laid(task))
            fit = _correspondence(task, first)
        with timed(task.seconds, "optimize"), one_blas_thread():
            laid = self.certified(first)
        return Attempt(laid, Course(Counter(), {}, self.why), fit, Weights())

    def certified(self, first: SplineMap) -> CertifiedMap:
        """Return the map with its certificate at volume 1."""
        return CertifiedMap.of(first)

    def _laid(self, task: MappingTask) -> SplineMap:
        """Return the map that `lay` makes, once for a run: the forecast asks first."""
        return task.fact((self.name, task.config.spline), lambda: self.lay(task))

    def serves(self, attempt: Attempt) -> bool:
        """Return True: no other way makes a better map than proved blocks."""
        return True

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the certificate of the blocks, which the checkpoint keeps."""
        first = kept_blocks(task.checkpoints, lambda: self._laid(task))
        return Cost.of_certificate(first.control.shape[1], len(first.nets.knots))


def in_words(count: int, noun: str) -> str:
    """Return a number of things in words."""
    return f"{count} {noun}{'s' * (count > 1)}"


def _correspondence(task: MappingTask, first: SplineMap) -> Correspondence:
    """Return the surface's vertices with their places on the blocks, in double precision."""
    points, faces = task.surface.to_unit(task.surface.vertices), task.surface.faces
    body = first.body
    patches, parameters, _ = nearest_on_boundary(points, body, SampledBoundary.of(body, _SAMPLES))
    outer = np.array([[name in names for name in FACE_NAMES] for names in body.outer])
    owners = 6 * patches + np.argmax(on_faces(parameters) & outer[patches], axis=1)
    return task.correspondence(SlidingParameters(first.nets, parameters, owners, faces), points)


def kept_blocks(checkpoints: Checkpoints, lay: Callable[[], SplineMap]) -> SplineMap:
    """Return the first map of blocks of the checkpoint; if there is none, lay it and keep it.

    To find them may take minutes, and a run that resumes finds them again here.
    """
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        return _loaded(*saved)
    first = lay()
    nets = first.nets
    arrays = {
        "control": first.control,
        "knots": np.concatenate([row for knots in nets.knots for row in knots]),
        "lengths": np.array([[len(row) for row in knots] for knots in nets.knots]),
        "solids": nets.solids.numbers,
        "interfaces": rows_of(nets.interfaces),
    }
    state = {"degree": nets.degree, "solid_names": nets.solids.names}
    checkpoints.save(_CHECKPOINT, arrays, state)
    return first


def _loaded(arrays: dict[str, NDArray[Any]], state: dict[str, Any]) -> SplineMap:
    """Return the map of a checkpoint."""
    lengths = arrays["lengths"]
    rows = np.split(arrays["knots"], np.cumsum(lengths.ravel())[:-1])
    knots = tuple((rows[k], rows[k + 1], rows[k + 2]) for k in range(0, len(rows), 3))
    solids = PatchSolids(arrays["solids"], tuple(state["solid_names"]))
    nets = ControlNets(state["degree"], knots, interfaces_of(arrays["interfaces"]), solids)
    return SplineMap(nets, arrays["control"])
