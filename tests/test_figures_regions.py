"""Regions in colours: on a solid and on the surface of a part, whose shares are known by hand."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import hollow, ring
from matplotlib.colors import rgb_to_hsv
from mesh_files import CUBE, TRIANGLES

import iga_nn
from iga_nn.figures import regions as figures
from iga_nn.figures import render
from iga_nn.figures.first_view import best_sides
from iga_nn.figures.panels import Rendered
from parameterize.surface.surface import surface_from_arrays


@pytest.fixture
def drawn(monkeypatch):
    """The patches that would be drawn, from the front and from behind."""
    found = []
    monkeypatch.setattr(figures, "show_around", lambda panels, patches, **_: found.append(patches))
    monkeypatch.setattr(figures, "show", lambda panel, title, patches, view: found.append(patches))
    return found


def legend(figure):
    found = figure.legends or [panel.get_legend() for panel in figure.axes]
    return [text.get_text() for one in found for text in one.get_texts()]


def shares(patches, palette):
    """How many of the corners of all patches have each colour."""
    colors = np.concatenate([patch.colors.reshape(-1, 3) for patch in patches])
    return [np.mean(np.all(colors == color, axis=1)) for color in palette]


def test_conditions_on_a_solid_have_their_shares_of_its_faces(drawn):
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    body = iga_nn.Elasticity(fix="u0", load={"nz > 0.9 and x > 0.75": ("0", "0", "-1"), "nz > 0.9": ("0", "0", "1")})
    figure = figures.draw_conditions(None, iga_nn.BSplineVolume.uniform(grid), body.conditions)
    assert legend(figure) == ["fix: u0", "load: nz > 0.9 and x > 0.75", "load: nz > 0.9"]
    found = shares(drawn[0][:1], figures.region_colors(3))
    np.testing.assert_allclose(found, [1 / 6, 1 / 24, 3 / 24, 4 / 6], atol=2e-3)
    assert np.all(drawn[0][0].colors[0] == figures.region_colors(3)[0])  # u0 is the first face


@pytest.mark.parametrize("region", ["nz > 0.9", "nz > 0.99 and sqrt(x**2 + y**2) < 0.25 and abs(x - y) < 0.125"])
def test_the_names_of_conditions_fit_on_their_figure(drawn, region):
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    body = iga_nn.Elasticity(fix="u0", load={region: ("0", "0", "1")})
    figure = figures.draw_conditions(None, iga_nn.BSplineVolume.uniform(grid), body.conditions)
    names = [panel.get_legend().get_window_extent() for panel in figure.axes]
    assert names[0].x1 <= names[1].x0 and names[0].y1 <= figure.bbox.y1 and names[1].x1 <= figure.bbox.x1


def test_conditions_on_blocks_know_their_own_faces(drawn):
    """Of four blocks in a ring one face is named, and the upper face of each."""
    body = ring(4)
    held = iga_nn.Elasticity(fix="p2_v1", load={"w1": (0, 0, 1)}, pressure={"nz < -0.9": 1})
    figures.draw_conditions(None, body, held.conditions)
    (patch, _), palette = drawn[0], figures.region_colors(3)
    found = {"rest": set(), "fix": set(), "load": set(), "pressure": set()}
    for (owner, name), colors in zip(body.outer_faces, patch.colors, strict=True):
        for kind, color in zip(("fix", "load", "pressure", "rest"), palette, strict=True):
            if np.any(np.all(colors == color, axis=-1)):
                found[kind].add(f"p{owner}_{name}")
    assert found["fix"] == {"p2_v1"} and found["load"] == {f"p{k}_w1" for k in range(4)}
    assert found["pressure"] == {f"p{k}_w0" for k in range(4)} and len(found["rest"]) == 7


def test_regions_on_a_surface_end_within_triangles(drawn):
    surface = surface_from_arrays(CUBE, TRIANGLES)
    told = [iga_nn.Region(text, surface.part) for text in ("nz > 0.9", "x < 0.25", "y < 0.5")]
    figure = figures.draw_regions(None, surface, told)
    assert legend(figure) == ["nz > 0.9", "x < 0.25", "y < 0.5"]
    points = np.concatenate([patch.points.reshape(-1, 3) for patch in drawn[0]])
    colors = np.concatenate([patch.colors.reshape(-1, 3) for patch in drawn[0]])
    palette = figures.region_colors(3)
    rest = points[np.all(colors == palette[-1], axis=1)]
    assert rest[:, 0].min() >= 0.25 and rest[:, 1].min() >= 0.5 and rest[:, 1].max() == 1.0
    first = points[np.all(colors == palette[0], axis=1)]
    assert np.ptp(first, axis=0).tolist() == [1.0, 1.0, 0.0] and np.all(first[:, 2] == 1.0)


def test_each_region_is_seen_from_its_own_side_and_a_hidden_one_through_the_rest(drawn):
    """Of a hollow cube one side is held, and the cavity has a pressure."""
    body = hollow()
    held = iga_nn.Elasticity(fix="nx > 0.9 and x > 1", pressure={"box(-0.6, -0.6, -0.6, 0.6, 0.6, 0.6)": 1})
    sides = best_sides(body, held.conditions)
    assert [seen for _, seen in sides] == [True, False] and sides[0][0].towards[0] > 0.5
    figures.draw_conditions(None, body, held.conditions)
    assert [patch.opacity for patch in drawn[1]] == [1.0, figures.GLASS, 1.0]


def test_more_regions_than_colours_repeat_them():
    assert np.array_equal(figures.region_colors(11)[0], figures.region_colors(11)[10])


@pytest.mark.pictures
def test_the_picture_shows_the_region_and_grey(tmp_path):
    if not render.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {render.REMEDY}")
    surface = surface_from_arrays(CUBE, TRIANGLES)
    figures.draw_regions(tmp_path / "a.png", surface, [iga_nn.Region("x > -1")])
    figure = figures.draw_regions(None, surface, [iga_nn.Region("nz > 0.9")])
    blue = []
    for panel in figure.axes:
        (view,) = (artist for artist in panel.get_children() if isinstance(artist, Rendered))
        pixels = rgb_to_hsv(view.pixels.reshape(-1, 3) / 255.0)
        blue.append(np.count_nonzero((pixels[:, 1] > 0.5) & (np.abs(pixels[:, 0] - 0.57) < 0.05)))
    assert max(blue) > 1000 and min(blue) < 500 and (tmp_path / "a.png").is_file()  # one side shows the top
