"""Draws a map: faces, blocks, parameter lines, cut, distortion, and where it is not proved or meets itself."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from parameterize.arrays import Array
from parameterize.certificate.boundary import Meeting
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

from .colors import MOST_NAMED, ColorRange
from .cutaway import INSIDE, Painted, cut_of, octant_label, own_colors, visible
from .fields import (
    NAMED,
    PER_PATCH,
    SAMPLES,
    Samples,
    distortion_of,
    face_window,
    lines_of,
    outer_faces,
    points_of,
    points_on,
)
from .panels import panels_of
from .render import NAMELESS, Patch, check_drawable, plain_patch, view_of
from .style import color_bar, name_colors, save, show, show_around, show_inside

LINES = 10  # from one side of the cube to the other, with the last
WINDOW = 0.15  # of the cube, on every side of a meeting place
MEETING_COLORS = ("#4477aa", "#ee6677")
APART = 0.35  # of a block's distance from the middle of all, by which it is moved away
INTERFACE = "#ee6677"


def draw_faces(path: str | Path | None, body: BodyLike, marks: Array | None = None) -> Figure:
    """Draw the images of the six faces of the cube, each in its colour, from the front and from behind.

    Of several patches the outer faces are drawn, in the colour of their patch and, up to NAMED, with their names.
    marks: points (k, 3) shown as black balls, such as given corners (the paper's Fig. 13).
    """
    glued = as_body(body)
    if glued.is_single:
        return _draw_around(path, body, 0, "Images of the six faces of the unit cube", marks)
    names = _names_of(glued) if len(outer_faces(glued)) <= NAMED else NAMELESS
    return _draw_around(path, body, 0, "The patches and their outer faces", marks, names)


def _names_of(body: Body) -> dict[str, Array]:
    """Return the names of the outer faces of patches, each with the point in the middle of the face."""
    places = outer_faces(body)
    faces = points_of(body).on(places)
    middles = faces[:, faces.shape[1] // 2, faces.shape[2] // 2]
    names = [body.face_name(k // PER_PATCH, FACE_NAMES[k % PER_PATCH]) for k in places.tolist()]
    return dict(zip(names, middles, strict=True))


def draw_lines(path: str | Path | None, body: BodyLike) -> Figure:
    """Draw lines of constant parameters, a tenth apart, on the outer faces, from the front and from behind.

    Of many patches the borders are drawn.
    """
    lines = lines_of(body, LINES)
    title = "Lines of constant u, v, w, a tenth apart" if lines == LINES else "The outer faces of the patches"
    return _draw_around(path, body, lines, title)


def _draw_around(
    path: str | Path | None,
    body: BodyLike,
    lines: int,
    title: str,
    marks: Array | None = None,
    names: Mapping[str, Array] = NAMELESS,
) -> Figure:
    figure, (panels,) = panels_of(1, 2)
    painted = Painted(points_of(body), own_colors(body), lines)
    show_around(panels, painted.at(outer_faces(body)), marks, names)
    name_colors(figure, body)
    return save(figure, path, title)


def draw_cut(path: str | Path | None, body: BodyLike) -> Figure:
    """Draw the volume without one octant of the cube (the paper's Fig. 9): parameter lines, and the distortion.

    The octant and the view are those that show most of the cut. Of several patches the octants that lie in the upper
    half and towards the viewer are left out.
    """
    points, field, lines = points_of(body), distortion_of(body), lines_of(body, LINES)
    left_out, view = cut_of(body, points, points)
    figure, (panels,) = panels_of(1, 2)
    for panel, painted in zip(
        panels, (Painted(points, own_colors(body), lines), Painted(points, field, lines)), strict=True
    ):
        show(panel, "", visible(body, painted, left_out), view)
    name_colors(figure, body)
    color_bar(figure, field.limits, field.title)
    if not as_body(body).is_single:
        return save(figure, path, "Cut open: the upper octants of the patches, towards the viewer, are left out")
    u, v, w = np.argwhere(left_out[0])[0].tolist()
    return save(figure, path, f"Cut open: the octant {octant_label((u, v, w))} is left out")


def draw_distortion(path: str | Path | None, body: BodyLike) -> Figure:
    """Draw tanh(sqrt(ARAP) / 2) at volume 1, as the paper colours it, on the images of u, v and w = 1/2.

    Of several patches each is measured against its own box, and drawn where the body is cut open in three ways.
    """
    figure, (panels,) = panels_of(1, 3)
    field, points = distortion_of(body), points_of(body)
    show_inside(panels, body, points, Painted(points, field))
    color_bar(figure, field.limits, field.title)
    is_single = as_body(body).is_single
    return save(figure, path, "Distortion on the mid-sections" if is_single else "Distortion of the patches inside")


def draw_blocks(path: str | Path | None, body: Body) -> Figure:
    """Draw the blocks apart, each in its colour and with light glued faces, and the interfaces in the glass body.

    Of more than MOST_NAMED blocks the colours say how much each is distorted, and the body is cut open in place of the
    interfaces.
    """
    if len(body) > MOST_NAMED:
        return _draw_many(path, body)
    places = np.flatnonzero(np.arange(PER_PATCH * len(body)) % PER_PATCH < len(FACE_NAMES))
    outer, colors, moved = outer_faces(body), own_colors(body), _apart(points_of(body))
    glued = np.setdiff1d(places, outer)
    colors[glued] = to_rgb(INSIDE)
    apart, whole = Painted(moved, colors).at(places), Painted(points_of(body), np.full_like(colors, to_rgb(INTERFACE)))
    view = view_of(whole.at(outer))
    figure, (panels,) = panels_of(1, 2)
    show(panels[0], "drawn apart", apart, view)
    show(panels[1], "interfaces", [*whole.at(glued), *glass(body)], view)
    name_colors(figure, body)
    count = len(body.interfaces)
    joints = f"{count} interface" + ("s" if count != 1 else "")
    return save(figure, path, f"{len(body)} blocks, {joints}; glued faces are light")


def _draw_many(path: str | Path | None, body: Body) -> Figure:
    """Draw many blocks, whole and cut open, in colours of the mean distortion of each."""
    field, points = distortion_of(body), points_of(body)
    means = field.lattices.mean(axis=(1, 2, 3))
    limits = ColorRange(float(means.min()), float(means.max())) if np.ptp(means) > 0.0 else field.limits
    painted = Painted(points, np.repeat(limits.colors(means), PER_PATCH, axis=0), lines_of(body, 1))
    left_out, view = cut_of(body, points, points)
    figure, (panels,) = panels_of(1, 2)
    show(panels[0], "the blocks", painted.at(outer_faces(body)), view)
    show(panels[1], "cut open", visible(body, painted, left_out), view)
    color_bar(figure, limits, f"mean of {field.title}")
    return save(figure, path, f"{len(body):,} blocks, {len(body.interfaces):,} interfaces")


def _apart(points: Samples) -> Samples:
    """Return the points of blocks, each moved away from the middle of all."""
    middles = points.lattices.mean(axis=(1, 2, 3))
    moves = APART * (middles - middles.mean(axis=0))
    planes = points.planes + moves[points.places // PER_PATCH, None, None]
    return Samples(points.places, planes, points.lattices + moves[:, None, None, None])


def draw_folds(path: str | Path | None, body: BodyLike, places: Array) -> Figure:
    """Draw the boundary as glass, and black balls at places (k, 3) inside: spans where det J's sign is not proved."""
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, glass(body), places)
    return save(figure, path, f"The sign of det J is not proved on {len(places)} spans: black balls")


def draw_meeting(path: str | Path | None, body: BodyLike, meeting: Meeting) -> Figure:
    """Draw the place where the boundary meets itself: on the whole boundary, and the two parts there from two sides."""
    mark = np.array([meeting.point])
    several, owners = as_body(body).patches, meeting.patches or (0, 0)
    windows = [
        points_on(several[owner], face_window(parameter, WINDOW, SAMPLES))
        for owner, parameter in zip(owners, meeting.parameters, strict=True)
    ]
    parts = [plain_patch(points, color, opacity=0.7) for points, color in zip(windows, MEETING_COLORS, strict=True)]
    figure, (panels,) = panels_of(1, 3)
    whole = glass(body)
    show(panels[0], "whole boundary", whole, view_of(whole), mark)
    show_around(panels[1:], parts, mark)
    return save(figure, path, "The boundary meets itself at the black ball; the two parts near it")


def glass(body: BodyLike) -> list[Patch]:
    """Return the outer faces as transparent patches."""
    colors = np.full_like(own_colors(body), 0.6)
    return Painted(points_of(body), colors, opacity=0.25).at(outer_faces(body))


PLOTS = {"faces": draw_faces, "lines": draw_lines, "cut": draw_cut, "distortion": draw_distortion}


def plot_body(body: BodyLike, what: str, file: str | Path | None) -> Figure:
    """Return one of the figures PLOTS of a body, written to `file`, too, where one is named."""
    check_drawable(what, PLOTS)
    return PLOTS[what](file, body)
