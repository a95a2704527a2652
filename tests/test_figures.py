from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import formula_parameterization
from matplotlib import colormaps
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

import solve
from iga_nn.cli.commands import main
from iga_nn.figures import colors, fields, line_plots, palette, ticks
from iga_nn.figures import cutaway as octant
from iga_nn.figures import map as map_figures
from iga_nn.figures import render as rendering
from iga_nn.figures import solution as solution_figures
from iga_nn.options import Units
from iga_nn.workflow.output_folder import RunFolder
from solve.study import benchmark_volume


@pytest.fixture
def drawing() -> None:
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")


def colored_share(path) -> float:
    """Share of the pixels that are not grey: what is drawn, without background and lettering."""
    image = imread(path)[..., :3]
    return float(np.mean(image.max(axis=-1) - image.min(axis=-1) > 0.1))


def test_history_marks_the_stages(tmp_path):
    line_plots.draw_history(tmp_path / "history.png", formula_parameterization().history)
    assert colored_share(tmp_path / "history.png") > 0.001
    assert [file.name for file in tmp_path.iterdir()] == ["history.png"]


@pytest.mark.parametrize(
    ("ends", "texts"),
    [
        ((1e-6, 1e2), ["10⁻⁶", "10⁻⁴", "10⁻²", "10⁰", "10²"]),
        ((3e-4, 7e-3), ["5·10⁻⁴", "10⁻³", "2·10⁻³", "5·10⁻³"]),
        ((2.5e-5, 4.5e-5), ["3·10⁻⁵", "4·10⁻⁵"]),
        ((9e-8, 1.63e-7), ["10⁻⁷", "1.2·10⁻⁷", "1.4·10⁻⁷", "1.6·10⁻⁷"]),
        ((3.21, 3.21003), ["3.21001", "3.21002"]),
    ],
)
def test_a_logarithmic_axis_shows_two_numbers_or_more(ends, texts):
    axes = Figure().subplots()
    axes.set(yscale="log", ylim=ends)
    ticks.show_powers(axes.yaxis)
    pairs = zip(axes.get_yticks(), labels(axes.yaxis), strict=True)
    seen = [text for place, text in pairs if ends[0] <= place <= ends[1]]
    assert set(texts) <= set(seen) and len(set(seen)) == len(seen) <= 10


def labels(axis):
    """The numbers that an axis shows at its ticks."""
    axis.figure.draw_without_rendering()
    return [tick.get_text() for tick in axis.get_ticklabels()]


def test_numbers_on_an_axis_have_eight_digits_at_most():
    values = (0.0, 1.0, 1e-12, 2.5e4, 3.315e-5, 3.1234567)
    assert [ticks.in_powers(value) for value in values] == ["0", "10⁰", "10⁻¹²", "2.5·10⁴", "3.315·10⁻⁵", "3.1234567"]


def shown_terms(history):
    """The names in the legend of the loss, of the terms alone."""
    (legend,) = [axes.get_legend() for axes in line_plots.draw_history(None, history).axes if axes.get_legend()]
    return {text.get_text() for text in legend.get_texts()} - {"loss"}


def test_the_legend_of_the_loss_names_what_is_seen():
    """Terms that are zero throughout, or below the axis, have no curve; a term of a single step has a dot."""
    steps = np.arange(20)
    history = {"stage": np.repeat("cube", 20), "step": steps, "loss": np.exp(-0.1 * steps), "folded": 0 * steps}
    history |= {"arap": np.full(20, 0.3), "bij": np.zeros(20), "star": np.full(20, 1e-10), "cor": np.full(20, np.nan)}
    assert shown_terms(history) == {"ARAP distortion"}
    assert shown_terms(history | {"bij": np.where(steps == 7, 1e-3, 0.0)}) == {"ARAP distortion", "folds"}
    assert shown_terms(history | {"star": np.full(20, 1e-7)}) == {"ARAP distortion", "faces seen from inside"}


def bar_of(figure):
    """The axes of the colour bar, the last of a figure."""
    return figure.axes[-1]


def test_a_solution_that_is_zero_on_the_boundary_is_seen_inside(drawing, small_views):
    """-div grad u = 1 on the unit cube with u = 0 on its boundary has its largest value, .05621, in the middle."""
    solution = solve.solve_problem(benchmark_volume(8, amplitude=0.0), solve.Poisson(source="1", boundary="0"))
    low, high = bar_of(solution.plot("values")).get_ylim()
    assert low == pytest.approx(0.0, abs=1e-12) and high == pytest.approx(0.0562136, rel=1e-3)


def test_a_range_counts_the_inside_where_no_section_passes():
    """x (1 - x) (1 - 2 x), at most 1 / (6 sqrt(3)), times the same of y and z is zero on all faces and mid-sections."""
    volume = benchmark_volume(4, amplitude=0.0)
    bump = "x*(1-x)*y*(1-y)*z*(1-z)*(1-2*x)*(1-2*y)*(1-2*z)"
    solution = solve.solve_problem(volume, solve.Poisson(exact=bump), refine=1)
    field = fields.solution_of(solution)
    assert np.abs(field.planes).max() < 1e-5
    assert field.limits.high == pytest.approx((3.0**-0.5 / 6.0) ** 3, rel=0.01)
    assert field.limits.low == pytest.approx(-field.limits.high, rel=1e-2)


def test_no_value_that_is_drawn_lies_outside_the_range():
    volume, problem = benchmark_volume(3), solve.Poisson(exact="exp(x)*sin(3*y)*z")
    solution = solve.solve_problem(volume, problem)
    for field in (
        fields.distortion_of(volume),
        fields.solution_of(solution),
        fields.error_of(volume, solution, problem),
    ):
        assert max(values.max() for values in field.everywhere) <= field.limits.high
        is_lowest = field.limits.logarithmic or min(values.min() for values in field.everywhere) >= field.limits.low
        assert is_lowest and field.lattices[0].shape == (fields.LATTICE,) * 3


def test_a_field_is_sampled_once_for_all_its_pictures(monkeypatch):
    volume, other, calls = benchmark_volume(1), benchmark_volume(1), []
    monkeypatch.setattr(fields, "sampled", lambda body, _: calls.append(body) or fields.Samples([], [], []))
    assert fields.points_of(volume) is fields.points_of(volume) and len(calls) == 1
    assert fields.points_of(other) is not fields.points_of(volume) and len(calls) == 2


def test_fields_in_figures_have_the_colours_of_the_bar(tmp_path, drawing, small_views):
    """Without shading, nearly all coloured pixels are mixtures of neighbouring colours of the map."""
    volume = benchmark_volume(2)
    solution = solve.solve_problem(volume, solve.Poisson(source="1", boundary="0"))
    figure = solution_figures.draw_solution(tmp_path / "solution.png", volume, solution)
    image = imread(tmp_path / "solution.png")[..., :3]
    panels = image[:, : int(0.8 * image.shape[1])].reshape(-1, 3)
    colored = panels[np.ptp(panels, axis=1) > 0.1]
    table = colormaps[palette.MAP](np.arange(256))[:, :3]
    off = np.array([np.abs(table - pixel).max(axis=1).min() for pixel in colored[::23]])
    assert len(off) > 1000 and np.mean(off < 0.03) > 0.75  # the others lie on lines and at the rim
    assert bar_of(figure).get_ylabel() == "u"
    figure = solution_figures.draw_solution(None, volume, solution, Units("$"))
    assert bar_of(figure).get_ylabel() == r"u [\$]"


def test_map_figures_show_the_map(tmp_path, drawing, small_views):
    volume = benchmark_volume(4)
    map_figures.draw_faces(tmp_path / "faces.png", volume)
    map_figures.draw_distortion(tmp_path / "distortion.png", volume)
    map_figures.draw_lines(tmp_path / "lines.png", volume)
    assert colored_share(tmp_path / "faces.png") > 0.1
    assert colored_share(tmp_path / "distortion.png") > 0.1


def hue_share(path, color) -> float:
    """Share of the coloured pixels that have the hue of a colour, shaded or not."""
    pixels = rgb_to_hsv(imread(path)[..., :3].reshape(-1, 3))
    strong = pixels[pixels[:, 1] > 0.3]
    return float(np.mean(np.abs(strong[:, 0] - rgb_to_hsv(to_rgb(color))[0]) < 0.02))


def test_lines_leave_the_faces_their_colours(tmp_path, drawing):
    volume = benchmark_volume(2)
    map_figures.draw_faces(tmp_path / "faces.png", volume)
    map_figures.draw_lines(tmp_path / "lines.png", volume)
    assert all(hue_share(tmp_path / "lines.png", color) > 0.01 for color in colors.FACE_COLORS)
    faces, lines = (imread(tmp_path / name)[60:, :, :3] for name in ("faces.png", "lines.png"))  # below the titles
    assert 0.02 < np.mean(np.abs(faces - lines).max(axis=-1) > 0.1) < 0.2


def test_cut_shows_the_inside(tmp_path, drawing):
    volume = benchmark_volume(2)
    map_figures.draw_cut(tmp_path / "cut.png", volume)
    left = imread(tmp_path / "cut.png")[:, :450, :3]
    inside = np.array(to_rgb(octant.INSIDE))
    brightness = left.mean(axis=-1, keepdims=True)
    alike = np.abs(left - inside * brightness / inside.mean()).max(axis=-1) < 0.02
    assert np.mean(alike & (brightness[..., 0] > 0.4) & (brightness[..., 0] < 0.93)) > 0.05


def test_cut_leaves_out_the_part_that_looks_at_the_viewer():
    cube, size = benchmark_volume(1, amplitude=0.0), np.array([3.0, 2.0, 1.0])
    volume = replace(cube, control_points=cube.control_points * size)
    planes = np.stack([fields.points_on(volume, grid) for grid in fields.all_grids(9)])
    painted = octant.Painted(fields.Samples(np.arange(9), planes, np.empty(0)), octant.own_colors(volume))
    corner, view = octant.best_cut(planes[:6])
    outward = 2.0 * np.array(corner) - 1.0
    assert np.all(np.sign(view.towards) == outward)
    shown = octant.visible(volume, painted, octant.only(corner))
    faces = [points for patch in shown for points in patch.points]
    offsets = [(points.reshape(-1, 3) / size - 0.5) * outward for points in faces]
    assert not np.any(np.all(np.concatenate(offsets) > 1e-9, axis=1))  # nothing of the octant's outside
    planes = [np.flatnonzero(np.all(np.abs(offset) < 1e-12, axis=0)) for offset in offsets]
    assert sorted(np.concatenate(planes)) == [0, 1, 2]
    assert sum(len(offset) for offset in offsets) == 3 * 9**2 + 9 * 5**2 + 3 * 5**2


def test_error_figure_also_where_the_error_is_rounding(tmp_path, drawing, small_views):
    volume = benchmark_volume(4)
    problem = solve.Poisson(exact="x")
    solution_figures.draw_error(tmp_path / "error.png", volume, solve.solve_problem(volume, problem), problem)
    assert colored_share(tmp_path / "error.png") > 0.05


def test_the_error_of_vectors_is_a_length():
    volume, problem = benchmark_volume(2), solve.Elasticity(exact=("x*y", "sin(z)", "x"))
    solution = solve.solve_problem(volume, problem)
    n, field = fields.SAMPLES, fields.error_of(volume, solution, problem)
    x, y, z = np.moveaxis(fields.points_of(volume).planes[4], -1, 0)
    exact = np.stack([x * y, np.sin(z), x], axis=-1)
    found = solution.grid(*fields.all_grids(n)[4]).reshape(n, n, 3)
    assert field.planes[4] == pytest.approx(np.linalg.norm(exact - found, axis=-1), abs=1e-14)


def test_study_has_a_curve_a_degree(tmp_path):
    problem = solve.Poisson(exact="x*y*z")
    study = {degree: solve.convergence(benchmark_volume(2), problem, (0, 1), degree) for degree in (2, 3)}
    line_plots.draw_study(tmp_path / "study.png", study)
    image = imread(tmp_path / "study.png")[..., :3]
    for color in colors.FACE_COLORS[:2]:
        assert np.count_nonzero(np.abs(image - to_rgb(color)).max(axis=-1) < 0.02) > 100


def test_a_study_draws_relative_errors_beside_absolute_ones():
    volume, problem = benchmark_volume(2), solve.Poisson(exact="1000*exp(x)*y*z")
    levels = solve.convergence(volume, problem, (0, 1))
    figure = line_plots.draw_study(None, {3: levels})
    figure.draw_without_rendering()
    for panel, name, relative in zip(figure.axes, ("l2", "h1_seminorm"), ("l2_relative", "h1_relative"), strict=True):
        (absolute,) = panel.child_axes
        drawn = panel.lines[0].get_ydata()
        assert drawn == pytest.approx([getattr(row.report, relative) for row in levels])
        assert (panel.get_ylabel(), absolute.get_ylabel()) == ("relative", "absolute")
        norm = getattr(levels[1].report, name) / drawn[1]  # of the solution
        assert absolute.get_ylim() == pytest.approx(norm * np.array(panel.get_ylim()))
    other = solve.convergence(benchmark_volume(2, amplitude=0.0), problem, (0,))
    assert line_plots.draw_study(None, {2: other, 3: levels}).axes[0].child_axes == []  # two volumes, two norms
    nothing = solve.convergence(volume, solve.Poisson(exact="0*x"), (0,))
    assert line_plots.draw_study(None, {3: nothing}).axes[0].get_ylabel() == "absolute"


@pytest.mark.pictures
@pytest.mark.slow
def test_plots_of_curves_are_also_written_as_pdf(in_folder, formula_training, monkeypatch):
    formula_training()
    monkeypatch.setattr(rendering, "can_draw", lambda: False)  # this is about curves
    benchmark_volume(2).save("map.npz")
    assert main(["parameterize", "cube", "--quiet", "--vector"]) == 0
    assert main(["solve", "poisson", "map.npz", "--quiet", "--vector"]) == 0
    assert main(["study", "map.npz", "--refine", "0", "1", "--quiet", "--vector"]) == 0
    for name in ("cube/history", "map/convergence", "map-study/study"):
        assert Path(f"{name}.png").stat().st_size > 5000
        assert Path(f"{name}.pdf").read_bytes().startswith(b"%PDF-")
    assert main(["solve", "poisson", "map.npz", "--force", "--refine", "0", "--quiet"]) == 0
    assert not list(Path("map").glob("convergence.*"))  # of one level there is none, and none stays that is out of date
    assert main(["parameterize", "cube", "--force", "--quiet"]) == 0
    assert {path.name for path in Path("cube").glob("history.*")} == {"history.npz", "history.png"}


def test_picture_is_framed_whole(drawing):
    square = np.stack(np.meshgrid([0.0, 2.0], [0.0, 1.0], [0.0], indexing="ij"), axis=-1)[:, :, 0]  # (2, 2, 3)
    red = np.broadcast_to([1.0, 0.0, 0.0], square.shape)
    view = rendering.widest_view(square.reshape(-1, 3))
    (image,) = rendering.draw([rendering.Patch(square, red, lit=False)], [view], (400, 400))
    drawn = np.argwhere(image[..., 1] < 128)
    height, width = np.ptp(drawn, axis=0) + 1
    assert abs(width - 400 / 1.08) < 6 and abs(height - 200 / 1.08) < 6  # the longer side fills the frame, 4 % margin
    assert np.all(image[200, 200] == [255, 0, 0])  # colours as given


def test_marks_on_a_surface_are_seen(drawing):
    square = np.stack(np.meshgrid([0.0, 2.0], [0.0, 1.0], [0.0], indexing="ij"), axis=-1)[:, :, 0]
    patch = rendering.Patch(square, np.broadcast_to([1.0, 0.0, 0.0], square.shape), lit=False)
    view = rendering.widest_view(square.reshape(-1, 3))
    (image,) = rendering.draw([patch], [view], (400, 400), marks=np.array([[1.0, 0.5, 0.0]]))
    assert np.all(image[200, 200] < 60) and np.all(image[200, 240] == [255, 0, 0])


def test_widest_view_is_a_right_handed_frame_along_the_thin_axis():
    rng = np.random.default_rng(0)
    cloud = rng.normal(size=(500, 3)) * [1.0, 0.1, 5.0]
    view = rendering.widest_view(cloud)
    frame = np.stack([view.right, view.up, view.towards])
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert abs(view.right[2]) > 0.99 and abs(view.towards[1]) > 0.99


def test_without_graphics_library_one_line_names_the_remedy(monkeypatch, caplog, tmp_path):
    crash = subprocess.CompletedProcess([], returncode=-11)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: crash)
    rendering.can_draw.cache_clear()
    try:
        result = formula_parameterization()
        state = RunFolder(tmp_path)
        state.draw("map", volume=result.volume, history=result.history)
    finally:
        rendering.can_draw.cache_clear()
    assert [file.name for file in tmp_path.iterdir()] == ["history.png"]
    assert "libegl1 libgl1-mesa-dri" in caplog.text
    assert state.report["not_drawn"] == dict.fromkeys(("lines.png", "cut.png", "distortion.png"), rendering.CANNOT_DRAW)
