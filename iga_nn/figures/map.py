"""Draws a map: faces, parameter lines, cut, distortion, and where it is not proved or meets itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from parameterize.arrays import Array
from parameterize.certificate.boundary import Meeting
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume

from .cutaway import best_cut, octant_label, patches_of, without_octant
from .evaluate import SECTIONS, face_window, points_on
from .fields import SAMPLES, distortion_of, points_of
from .render import Patch, check_drawable, draw, plain_patch, view_of
from .style import PANEL, color_bar, colors, name_faces, panels_of, save, show_around, show_section

EVERY = 12  # samples between two parameter lines: a tenth of the cube
WINDOW = 0.15  # of the cube, on every side of a meeting place
MEETING_COLORS = ("#4477aa", "#ee6677")


def draw_faces(path: str | Path | None, volume: BSplineVolume, marks: Array | None = None) -> Figure:
    """Draw the images of the six faces of the cube, each in its colour, from the front and from behind.

    marks: points (k, 3) shown as black balls, such as given corners (the paper's Fig. 13).
    """
    return _draw_around(path, volume, 0, "Images of the six faces of the unit cube", marks)


def draw_lines(path: str | Path | None, volume: BSplineVolume) -> Figure:
    """Draw lines of constant parameters, a tenth apart, on the images of the six faces, from the front and behind."""
    return _draw_around(path, volume, EVERY, "Lines of constant u, v, w, a tenth apart")


def _draw_around(
    path: str | Path | None, volume: BSplineVolume, every: int, title: str, marks: Array | None = None
) -> Figure:
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, patches_of(points_of(volume).patches, every)[:6], marks)
    name_faces(figure)
    return save(figure, path, title)


def draw_cut(path: str | Path | None, volume: BSplineVolume) -> Figure:
    """Draw the volume without one octant of the cube (the paper's Fig. 9): parameter lines, and the distortion.

    Octant and view are chosen so that most of the cut is seen.
    """
    named, field = patches_of(points_of(volume).patches, EVERY), distortion_of(volume)
    octant, view = best_cut(named[:6], orientation(volume))
    distorted = [
        replace(patch, colors=colors(values, field.limits), lit=False)
        for patch, values in zip(named, field.patches, strict=True)
    ]
    figure, (panels,) = panels_of(1, 2)
    for panel, patches in zip(panels, (named, distorted), strict=True):
        panel.imshow(draw(without_octant(patches, octant), view, PANEL))
    name_faces(figure)
    color_bar(figure, panels, field.limits, field.title)
    return save(figure, path, f"Cut open: the octant {octant_label(octant)} is left out")


def draw_distortion(path: str | Path | None, volume: BSplineVolume) -> Figure:
    """Draw tanh(sqrt(ARAP) / 2) at volume 1, as the paper colours it, on the images of u, v and w = 1/2."""
    figure, (panels,) = panels_of(1, 3)
    field = distortion_of(volume)
    shown = zip(panels, SECTIONS, points_of(volume).patches[6:], field.patches[6:], strict=True)
    for panel, title, points, values in shown:
        show_section(panel, title, points, colors(values, field.limits))
    color_bar(figure, panels, field.limits, field.title)
    return save(figure, path, "Distortion on the mid-sections")


def draw_folds(path: str | Path | None, volume: BSplineVolume, places: Array) -> Figure:
    """Draw the boundary as glass, and black balls at places (k, 3) inside: spans where det J's sign is not proved."""
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, _glass(volume), places)
    return save(figure, path, f"The sign of det J is not proved on {len(places)} spans: black balls")


def draw_meeting(path: str | Path | None, volume: BSplineVolume, meeting: Meeting) -> Figure:
    """Draw the place where the boundary meets itself: on the whole boundary, and the two parts there from two sides."""
    mark = np.array([meeting.point])
    windows = [points_on(volume, face_window(parameter, WINDOW, SAMPLES)) for parameter in meeting.parameters]
    parts = [plain_patch(points, color, opacity=0.7) for points, color in zip(windows, MEETING_COLORS, strict=True)]
    figure, (panels,) = panels_of(1, 3)
    glass = _glass(volume)
    panels[0].imshow(draw(glass, view_of(glass), PANEL, mark))
    panels[0].set_title("whole boundary", fontsize=13)
    show_around(panels[1:], parts, mark)
    return save(figure, path, "The boundary meets itself at the black ball; the two parts near it")


def _glass(volume: BSplineVolume) -> list[Patch]:
    """Return the six faces as transparent patches."""
    return [plain_patch(points, "0.6", opacity=0.25) for points in points_of(volume).patches[:6]]


PLOTS = {"faces": draw_faces, "lines": draw_lines, "cut": draw_cut, "distortion": draw_distortion}


def plot_volume(volume: BSplineVolume, what: str, file: str | Path | None) -> Figure:
    """Return one of the figures PLOTS of a volume, written to `file`, too, where one is named."""
    check_drawable(what, PLOTS)
    return PLOTS[what](file, volume)
