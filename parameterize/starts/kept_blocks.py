"""Keeps the blocks that a start lays: to find them may take minutes, and a run that resumes finds them again here."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checkpoint import Checkpoints
from ..layouts.skeleton.choice import Choice
from ..spline.control_nets import ControlNets
from ..spline.interface import Interface
from ..spline.spline_map import SplineMap

_CHECKPOINT = "first"


def kept_blocks(checkpoints: Checkpoints, choice: Choice, lay: Callable[[], SplineMap]) -> SplineMap:
    """Return the first map of blocks of the checkpoint; where there is none, lay it and keep it with the choice."""
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        return _loaded(*saved)
    first = lay()
    nets = first.nets
    arrays = {
        "control": first.control,
        "knots": np.concatenate([row for knots in nets.knots for row in knots]),
        "lengths": np.array([[len(row) for row in knots] for knots in nets.knots]),
    }
    state = {"degree": nets.degree, "interfaces": [asdict(one) for one in nets.interfaces]}
    checkpoints.save(_CHECKPOINT, arrays, state | {"choice": asdict(choice)})
    return first


def kept_choice(checkpoints: Checkpoints) -> Choice | None:
    """Return the choice that led to the blocks of the checkpoint, None where there is none."""
    saved = checkpoints.load(_CHECKPOINT)
    return None if saved is None else Choice(**saved[1]["choice"])


def _loaded(arrays: dict[str, NDArray[Any]], state: dict[str, Any]) -> SplineMap:
    """Return the map of a checkpoint."""
    lengths = arrays["lengths"]
    rows = np.split(arrays["knots"], np.cumsum(lengths.ravel())[:-1])
    knots = tuple((rows[k], rows[k + 1], rows[k + 2]) for k in range(0, len(rows), 3))
    interfaces = tuple(_interface(**values) for values in state["interfaces"])
    return SplineMap(ControlNets(state["degree"], knots, interfaces), arrays["control"])


def _interface(first: list[Any], second: list[Any], swapped: bool, flipped: list[bool]) -> Interface:
    """Return an interface from the values of its fields as JSON has them."""
    p, face_p = first
    q, face_q = second
    a, b = flipped
    return Interface((p, face_p), (q, face_q), swapped, (a, b))
