"""Draws the figures of an output folder from the table of artifacts; one that fails costs nothing but itself."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import figures
from ..errors import one_line
from .artifacts import ARTIFACTS, Part

log = logging.getLogger(__name__)

PNG = (".png",)


def draw_figures(folder: Path, part: Part, known: Mapping[str, Any], endings: Sequence[str] = PNG) -> dict[str, str]:
    """Draw each figure of one part that `known` suffices for, and return why others were not drawn, by file name.

    endings: of the files a curve is written to.
    """
    failures: dict[str, str] = {}
    for artifact in ARTIFACTS:
        if not artifact.draw or artifact.part != part or not known.keys() >= set(artifact.takes):
            continue
        if not artifact.is_curve and not figures.can_draw():
            failures[artifact.file] = figures.CANNOT_DRAW
            continue
        for ending in endings if artifact.is_curve else PNG:
            path = (folder / artifact.file).with_suffix(ending)
            try:
                getattr(figures, artifact.draw)(path, *(known[name] for name in artifact.takes))
            except Exception as error:
                failures[path.name] = one_line(error) or type(error).__name__
                log.warning("%s could not be drawn: %s", path.name, failures[path.name])
    return failures
