"""Starts from columns over the profiles of a stack of extrusions, which are left as they are."""

from dataclasses import dataclass

from ..checkpoint import Checkpoints
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from .kept_blocks import kept_blocks
from .planes import kept
from .start import Attempt, Start, Task


@dataclass(frozen=True)
class StackOfExtrusions(Start):
    """Make a map of columns, which is certified and left as it is."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt:
        """Return the attempt whose map is the task's columns, which a checkpoint keeps."""

        def lay() -> SplineMap:
            assert task.columns is not None, "this start follows where the choice is columns"
            return task.columns.spline

        return kept(task, kept_blocks(checkpoints, task.choice, lay), Reason.LAID)


COLUMNS = StackOfExtrusions("columns", "columns", "laying blocks along the outlines of extrusions")
