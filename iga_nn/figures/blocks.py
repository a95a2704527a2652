"""Draws the blocks of a body apart, and the interfaces along which they are glued."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from parameterize.arrays import Array
from parameterize.spline.body import Body
from parameterize.spline.volume import FACE_NAMES

from .cutaway import INSIDE
from .evaluate import PER_PATCH, outer_faces
from .fields import points_of
from .map import glass
from .palette import face_colors
from .render import draw, plain_patch, view_of
from .style import PANEL, name_colors, panels_of, save

APART = 0.35  # of a block's distance from the middle of all, by which it is moved away
INTERFACE = "#ee6677"


def draw_blocks(path: str | Path | None, body: Body) -> Figure:
    """Draw the blocks apart, each in its colour and with light glued faces, and the interfaces in the glass body."""
    points, outer = points_of(body).patches, outer_faces(body)
    every = [PER_PATCH * number + face for number in range(len(body)) for face in range(len(FACE_NAMES))]
    glued = [k for k in every if k not in set(outer)]
    palette, moves = face_colors(body), _moves(points, len(body))
    apart = [
        plain_patch(points[k] + moves[k // PER_PATCH], INSIDE if k in set(glued) else palette[number])
        for number, k in enumerate(every)
    ]
    view = view_of([plain_patch(points[k], "0.6") for k in outer])
    interfaces = [plain_patch(points[k], INTERFACE) for k in glued]
    figure, (panels,) = panels_of(1, 2)
    for panel, title, patches in zip(
        panels, ("drawn apart", "interfaces"), (apart, [*interfaces, *glass(body)]), strict=True
    ):
        panel.imshow(draw(patches, view, PANEL))
        panel.set_title(title, fontsize=13)
    name_colors(figure, body)
    return save(figure, path, f"{len(body)} blocks, {len(body.interfaces)} interfaces; glued faces are light")


def _moves(points: Sequence[Array], count: int) -> Array:
    """Return by how much each block is moved, (count, 3). points: of nine faces and sections a block."""
    own = [points[PER_PATCH * k : PER_PATCH * (k + 1)] for k in range(count)]
    middles = np.array([np.mean([where.mean(axis=(0, 1)) for where in parts], axis=0) for parts in own])
    return np.asarray(APART * (middles - middles.mean(axis=0)))
