"""Draws the figures of one part of a run, and says which could not be drawn."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..errors import one_line
from ..report.artifacts import ARTIFACTS, Part

log = logging.getLogger(__name__)

Found = list[tuple[str, tuple[Any, ...], Any]]  # as in figures.fields
Failures = dict[str, str]  # of figures: what was to be drawn, and the reason why it is not


@dataclass(frozen=True, eq=False)
class Figures:
    """Describe figures to draw: those of a part of a run for which the values `known` suffice.

    known: values by their names in the table of artifacts. vector: whether plots of curves are also written as PDF.
    found: samples of these values for a process that has none, see `sampled`.
    """

    folder: Path
    part: Part
    known: dict[str, Any]
    vector: bool = False
    found: Found = field(default_factory=list)


def sampled(figures: Figures) -> Figures:
    """Return figures with the samples that they are drawn of, which the view in the page takes, too."""
    from parameterize.spline.body import as_body

    from ..figures import fields

    known = figures.known
    if (body := known.get("volume")) is not None:
        fields.points_of(body)
        fields.distortion_of(body)
        if as_body(body).is_single:
            fields.hand_of(body)
    if (solution := known.get("solution")) is not None:
        fields.fields_of(solution)
        if (problem := known.get("problem")) is not None:
            fields.error_of(body, solution, problem)
    return replace(figures, found=fields.found_of(known.values()))


def draw(figures: Figures, can_draw: Callable[[], bool] | None = None) -> Failures:
    """Draw figures and return the failures; no exception is raised.

    can_draw: whether VTK can draw here; by default it is tried in a process of its own.
    """
    failures: Failures = {}
    with drawing("figures", failures):
        from ..figures import fields, render

        fields.recall(figures.found)
        for figure in ARTIFACTS:
            if not figure.draw or figure.part != figures.part or not figures.known.keys() >= set(figure.takes):
                continue
            if not figure.is_curve and not (can_draw or render.can_draw)():
                failures[figure.file] = render.CANNOT_DRAW
                continue
            for ending in (".png", ".pdf") if figure.is_curve and figures.vector else (".png",):
                path = (figures.folder / figure.file).with_suffix(ending)
                with drawing(path.name, failures):
                    figure.draw_to(path, figures.known)
    return failures


@contextmanager
def drawing(what: str, failures: Failures) -> Iterator[None]:
    """Let the block draw `what`; a failure, for example the import of matplotlib or VTK, is added to the others."""
    try:
        yield
    except Exception as error:  # no figure ends a run
        failures[what] = one_line(error) or type(error).__name__
        log.warning("%s could not be drawn: %s", what, one_line(error))
