"""Figures of bodies of several patches: what is seen of them, whole and cut open, and in which colours."""

from collections import Counter

import numpy as np
import pytest
from bodies import ring, row_of
from cube_grids import glued as glued_cubes
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.image import imread

import iga_nn
import solve
from iga_nn.figures import colors, cutaway, fields, style
from iga_nn.figures import map as map_figures
from iga_nn.figures import render as rendering
from iga_nn.figures import solution as solution_figures
from iga_nn.figures.fields import all_grids, outer_faces, points_on
from iga_nn.figures.outline import is_by_face, smooth_colors
from parameterize.certificate.boundary import Meeting
from parameterize.spline.volume import FACE_NAMES

TURNED = row_of(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0)],
    [(), ((2, 0, 1), (True, False, True)), ((1, 2, 0), (False, True, True))],
    degrees=(2, 2, 2),
    shape=(4, 4, 4),
)


@pytest.fixture
def drawing() -> None:
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")


def coarse(body):
    """The faces and sections of each patch, of four cells each: a cell is a quarter."""
    planes = np.stack([points_on(patch, grid) for patch in body for grid in all_grids(3)])
    return cutaway.Painted(fields.Samples(np.arange(len(planes)), planes, np.empty(0)), cutaway.own_colors(body))


def each(patches):
    """The points (m, n, 3) of each face or section."""
    return [points for patch in patches for points in patch.points]


def edges_of(patches):
    """How often each edge of a cell occurs among patches."""
    counts = Counter()
    for points in each(patches):
        x = np.round(points, 9) + 0.0
        for i, j in np.ndindex(len(x) - 1, x.shape[1] - 1):
            corners = [tuple(x[at].tolist()) for at in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            counts.update(frozenset(pair) for pair in zip(corners, [*corners[1:], corners[0]], strict=True))
    return counts


@pytest.mark.parametrize("body", [TURNED, ring(1), ring(3)])
def test_what_is_seen_of_a_body_is_a_closed_surface_whatever_is_left_out(body):
    """However patches are turned against each other, the quarters behind each other are known."""
    painted, random = coarse(body), np.random.default_rng(3)
    (whole,) = cutaway.visible(body, painted, np.zeros((len(body), 2, 2, 2), dtype=bool))
    assert np.array_equal(whole.points, painted.points.planes[outer_faces(body)])
    for _ in range(5):
        left_out = random.random((len(body), 2, 2, 2)) < 0.4
        seen = cutaway.visible(body, painted, left_out)
        assert len(each(seen)) > len(whole.points) and all(count % 2 == 0 for count in edges_of(seen).values())


def test_without_a_patch_the_face_behind_it_is_seen():
    body = TURNED
    left_out = np.zeros((3, 2, 2, 2), dtype=bool)
    left_out[0] = True
    first, second = body.interfaces[0].first, body.interfaces[0].second
    (behind,) = (place for place in (first, second) if place[0] != 0)
    seen = list(cutaway.seen_quarters(body, left_out))
    assert not seen[0].any()
    assert seen[behind[0]][FACE_NAMES.index(behind[1])].all()


def test_the_half_beyond_a_plane_is_left_out():
    rod = iga_nn.Body.from_patches(
        [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (a + u, v, w), 4) for a in range(3)]
    )
    left_out = cutaway.beyond(fields.points_of(rod), np.array([1.0, 0.0, 0.0]))
    assert left_out.sum(axis=(1, 2, 3)).tolist() == [0, 4, 8] and left_out[1, 1].all()


def test_each_patch_has_a_colour_and_many_share_them():
    few, many, more = (ring(count, shape=(3, 3, 2), degrees=(2, 2, 1)) for count in (3, 25, 45))
    assert [label for _, label in colors.color_labels(few)] == ["p0", "p1", "p2"]
    labels = [label for _, label in colors.color_labels(many)]
    assert len(labels) == 20 and labels[0] == "p0, p20" and labels[-1] == "p19"
    assert colors.color_labels(more) == [] and is_by_face(more) and not is_by_face(many)
    assert len(set(smooth_colors(more))) == 4  # inner and outer wall, lid and floor


def test_distortion_measures_each_patch_in_its_own_box():
    """A cube and a rod are not distorted, and no size of the body makes them so."""
    parts = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (a * u, v, a * w), 4) for a in (1.0, -3.0)]
    field = fields.distortion_of(iga_nn.Body(tuple(parts)))
    assert max(values.max() for values in field.everywhere) < 1e-6 and "each in its own box" in field.title


def test_a_field_of_a_body_is_that_of_each_patch():
    problem = solve.Poisson(exact="exp(X)*y")
    solution = iga_nn.solve(TURNED, problem)
    error = fields.error_of(TURNED, solution, problem)
    assert len(error.planes) == 27 and [len(part) for part in error.lattices] == [fields.OF_SEVERAL[1]] * 3
    assert error.limits.high < 0.1 * fields.solution_of(solution).limits.high
    stiff = iga_nn.solve(TURNED, solve.Elasticity(fix="x < 0.01", load={"p1_u0": (0, 0, 1)}, young={0: 1, 1: 50, 2: 1}))
    stress, own = fields.fields_of(stiff)[0], stiff.patches[1].quantity_grid("von_mises", *all_grids(81)[0])
    assert np.allclose(stress.planes[9], own.reshape(81, 81), rtol=1e-9)


@pytest.fixture
def as_if_many(monkeypatch):
    """Let three patches be sampled as thousands are: outer faces, and lattices without octants."""
    monkeypatch.setattr(fields, "FEW", 0)
    monkeypatch.setattr(fields, "OF_MANY", {2: (25, 11), np.inf: (9, 3)})


def test_of_many_patches_the_inside_is_drawn_from_the_lattices(as_if_many, monkeypatch):
    body, drawn = ring(3), shown(monkeypatch)
    points = fields.points_of(body)
    assert points.planes.shape == (12, 9, 9, 3) and points.lattices.shape == (3, 3, 3, 3, 3)
    for place in range(27):
        own = points_on(body.patches[place // 9], all_grids(9)[place % 9])
        (part,) = points.divided(np.array([place]))
        found = points.on(part)[0]
        assert np.allclose(found, own if len(found) == 9 else own[::4, ::4], atol=1e-12)
    left_out = cutaway.beyond(points, np.array([1.0, 0.0, 0.0]))
    assert all(len(np.unique(one)) == 1 for one in left_out) and 0 < left_out.sum() < left_out.size
    map_figures.draw_cut(None, body)
    solution_figures.draw_solution(None, body, iga_nn.solve(body, solve.Poisson(exact="x*y+z")))
    assert len(drawn) == 8 and {patch.points.shape[1] for patches in drawn for patch in patches} == {3, 9}


def test_names_and_legends_of_very_many_patches_are_left_out(monkeypatch):
    found = []
    monkeypatch.setattr(map_figures, "show_around", lambda panels, patches, marks, names: found.append(names))
    map_figures.draw_faces(None, ring(3))
    monkeypatch.setattr(map_figures, "NAMED", 11)
    map_figures.draw_faces(None, ring(3))
    assert len(found[0]) == 12 and not found[1]
    assert colors.color_labels(ring(81, shape=(2, 2, 2), degrees=(1, 1, 1))) == []


def test_figures_show_all_patches(tmp_path, drawing, small_views):
    body, problem = ring(3), solve.Poisson(exact="x*y+z")
    for name, draw in map_figures.PLOTS.items():
        draw(tmp_path / f"{name}.png", body)
    pixels = rgb_to_hsv(imread(tmp_path / "faces.png")[..., :3].reshape(-1, 3))
    for color in colors.PATCH_COLORS[:3]:
        assert np.mean(np.abs(pixels[pixels[:, 1] > 0.2][:, 0] - rgb_to_hsv(to_rgb(color))[0]) < 0.02) > 0.05
    solution = iga_nn.solve(body, problem)
    solution_figures.draw_solution(tmp_path / "solution.png", body, solution)
    figure = solution_figures.draw_error(tmp_path / "error.png", body, solution, problem)
    assert [axes.get_title() for axes in figure.axes][3:6] == ["cut across x", "cut across y", "cut across z"]
    for name in ("lines", "cut", "distortion", "solution", "error"):
        image = imread(tmp_path / f"{name}.png")[..., :3]
        assert np.mean(np.ptp(image, axis=-1) > 0.1) > 0.05


def shown(monkeypatch):
    """The patches that would be drawn, panel after panel."""
    found = []

    def draw(patches, views, *_):
        found.extend([patches] * len(views))
        return [np.zeros((2, 2, 3), dtype=np.uint8)] * len(views)

    monkeypatch.setattr(style, "draw", draw)
    return found


def test_blocks_are_drawn_apart_and_their_interfaces_in_glass(monkeypatch, small_views):
    body = ring(3)
    found = shown(monkeypatch)
    figure = map_figures.draw_blocks(None, body)
    apart, glued = found
    (apart,) = apart
    assert len(apart.points) == 18 and [len(patch.points) for patch in glued] == [6, 12]
    assert [patch.opacity < 1.0 for patch in glued] == [False, True]
    light = [k for k, colors in enumerate(apart.colors) if np.allclose(colors[0, 0], to_rgb(cutaway.INSIDE))]
    assert light == [6 * i + FACE_NAMES.index(face) for i in range(3) for face in ("u0", "u1")]
    ends = [apart.points[1], apart.points[6]]  # p0_u1 = p1_u0: the gap opens
    assert np.linalg.norm(ends[0] - ends[1], axis=-1).min() > 0.5
    assert figure.get_suptitle() == "3 blocks, 3 interfaces; glued faces are light"
    figure = map_figures.draw_blocks(None, glued_cubes([(0, 0, 0), (1, 0, 0)]))
    assert figure.get_suptitle() == "2 blocks, 1 interface; glued faces are light"


def test_places_without_a_proof_and_meetings_are_shown_on_blocks(monkeypatch, small_views):
    body = ring(3)
    around, drawn = [], shown(monkeypatch)
    monkeypatch.setattr(map_figures, "show_around", lambda panels, patches, marks: around.append((patches, marks)))
    map_figures.draw_folds(None, body, np.zeros((1, 3)))
    meeting = Meeting(((0.5, 1.0, 0.5), (0.5, 0.0, 0.5)), (2.0, 0.0, 0.0), (0, 2))
    map_figures.draw_meeting(None, body, meeting)
    (glass, _), (parts, marks) = around
    assert len(each(glass)) == len(each(drawn[0])) == 12 and marks.tolist() == [[2.0, 0.0, 0.0]]
    for part, owner, parameter in zip(parts, meeting.patches, meeting.parameters, strict=True):
        middle = part.points[len(part.points) // 2, part.points.shape[1] // 2]
        assert middle == pytest.approx(body.patches[owner]([parameter])[0])
