"""Draws figures of maps and solutions. All values are samples of the spline itself; VTK only draws them.

Each function takes the file to write first, None for none, and returns the figure.
"""

from .curves import draw_history, draw_study
from .map import draw_cut, draw_distortion, draw_faces, draw_folds, draw_lines, draw_meeting
from .render import CANNOT_DRAW, can_draw
from .solution import draw_error, draw_values

__all__ = [
    "CANNOT_DRAW",
    "can_draw",
    "draw_cut",
    "draw_distortion",
    "draw_error",
    "draw_faces",
    "draw_folds",
    "draw_history",
    "draw_lines",
    "draw_meeting",
    "draw_study",
    "draw_values",
]
