"""Shows the inside of a body on three panels: mid-sections of a volume, or several patches cut open three times."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body

from .cutaway import beyond, visible
from .evaluate import SECTIONS
from .fields import Samples
from .render import Patch, View, draw
from .style import PANEL, show_section

UP, ASIDE = 0.4, 0.25  # of a viewer in front of a cut: shows more than one side of what is left


def show_inside(panels: Any, body: BodyLike, points: Samples, patches: Sequence[Patch]) -> None:
    """Draw the nine patches of each patch of a body on three panels. points: of the body at rest.

    Of a volume these are its mid-sections. Several patches are drawn without the octants on the far side of x, of y and
    of z, as one sees them from there.
    """
    if as_body(body).is_single:
        for panel, title, patch in zip(panels, SECTIONS, patches[6:], strict=True):
            show_section(panel, title, patch.points, patch.colors)
        return
    for panel, name, towards in zip(panels, "xyz", np.eye(3), strict=True):
        panel.imshow(draw(visible(body, patches, beyond(points, towards)), _alignment(towards), PANEL))
        panel.set_title(f"cut across {name}", fontsize=13)


def _alignment(direction: Array) -> View:
    """Return the view of a viewer who looks against an axis of space, a little from above and aside."""
    up = np.array([0.0, 1.0, 0.0]) if direction[2] else np.array([0.0, 0.0, 1.0])
    towards = direction + UP * up + ASIDE * np.cross(up, direction)
    towards /= np.linalg.norm(towards)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return View(right, np.cross(towards, right), towards)
