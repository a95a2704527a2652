from __future__ import annotations

import ast
import csv
import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import formula_parameterization
from example_files import EXAMPLES, load, shown
from matplotlib.image import imread
from small_run import shortened

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures.render import can_draw
from iga_nn.workflow.mapping import read_corners
from parameterize.display import Shown
from solve.study import benchmark_volume

pytestmark = pytest.mark.usefixtures("small_views", "few_distances")


@pytest.fixture
def formula_map(formula_training, monkeypatch):
    """Training replaced by a formula, for `iga_nn.run` and for `iga_nn.parameterize`."""
    assert iga_nn.parameterize  # loaded before it is replaced: else the formula would be what is put back
    formula_training()
    given = {}

    def parameterize(surface, config=None, **options):
        given.update(options)
        return formula_parameterization()

    monkeypatch.setattr(iga_nn, "parameterize", parameterize, raising=False)
    return given


def test_first_run(capsys, tmp_path):
    config = shortened(iga_nn.preset("fast")).with_control_points(8)
    picture = load("first_run").main("ellipsoid", config, levels=2, out=tmp_path)
    out = capsys.readouterr().out
    assert "ARAP" in out and "L2 rate" in out
    assert shown(picture)


@pytest.mark.slow
def test_own_mesh(formula_map, tmp_path, capsys):
    assert shown(load("own_mesh").main(out=tmp_path / "sample"))
    out = capsys.readouterr().out
    assert "3000 vertices" in out and "certificate: certified" in out and "report.html" in out
    (tmp_path / "open.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
    with pytest.raises(SystemExit, match="open"):
        load("own_mesh").main(tmp_path / "open.obj", tmp_path / "refused")


def test_given_corners(formula_map, tmp_path):
    picture = load("given_corners").main("cube", out=tmp_path)
    assert shown(picture)
    corners = formula_map["corners"]
    assert np.allclose(corners[0], 0.5 - 0.275) and np.allclose(corners[7, 2], 0.775)  # the cube's own box
    assert np.allclose(read_corners(tmp_path / "corners.json"), corners)  # as --corners takes them


def test_boundary_conditions_near_the_formula(tmp_path, capsys):
    assert shown(load("boundary_conditions").main(out=tmp_path))
    found, known = (float(part.split()[-1]) for part in capsys.readouterr().out.split("half-way: ")[1].split(", by"))
    assert found == pytest.approx(known, rel=0.01)


def test_compare_finds_the_better_map(tmp_path, capsys):
    assert shown(load("compare").main(out=tmp_path, refine=0))
    good, worse = capsys.readouterr().out.splitlines()[1:]
    assert float(good.split()[-1]) < float(worse.split()[-1])
    assert good.split()[-8] == worse.split()[-8] == "certified"


def test_load_volume(tmp_path, capsys):
    assert shown(load("load_volume").main(out=tmp_path))
    assert "certificate: certified" in capsys.readouterr().out
    assert (tmp_path / "column.xml").exists()


def test_export_files(tmp_path, capsys):
    assert shown(load("export_files").main(out=tmp_path))
    files = [Path(line) for line in capsys.readouterr().out.split()]
    assert {file.suffix for file in files} == {".vtu", ".mesh", ".xml"} and all(file.exists() for file in files)


def test_elasticity_near_beam_theory(tmp_path, capsys):
    assert shown(load("elasticity").main(out=tmp_path))
    found, known = (float(part.split()[-1]) for part in capsys.readouterr().out.split("sinks by ")[1].split(", beam"))
    assert found == pytest.approx(known, rel=0.02)


def numbers(text, pattern):
    return [float(found) for found in re.findall(pattern, text)]


@pytest.mark.slow
def test_bracket_balances_its_load_and_is_near_beam_theory(tmp_path, capsys):
    assert shown(load("bracket").main(out=tmp_path))
    out = capsys.readouterr().out
    stress, theory = numbers(out, r"(-\S+) MPa")
    assert stress == pytest.approx(theory, rel=0.05)
    assert numbers(out, r"(\S+)\), fix") == [-1000.0] and numbers(out, r"(\S+)\) \(balanced") == [1000.0]


@pytest.mark.slow
def test_rational_ring_is_lames(tmp_path, capsys):
    assert shown(load("rational_ring").main(out=tmp_path))
    out = capsys.readouterr().out
    assert "certificate: certified" in out
    found, known = numbers(out, r"(?:volume|formula) (\d\S+?),?(?=\s)")
    assert found == pytest.approx(known, rel=1e-13)
    assert numbers(out, r"L2 rate ([\d.]+)")[-1] == pytest.approx(4.0, abs=0.3)
    stress, lame = numbers(out, r"(?:inside:|Lamé) ([\d.]+)")
    assert stress == pytest.approx(lame, rel=1e-3)


def test_an_edge_that_points_inward_limits_the_rate(tmp_path, capsys):
    assert shown(load("l_shape").main(out=tmp_path))
    rates = [float(rate) for rate in re.findall(r"L2 rate ([\d.]+)", capsys.readouterr().out)]
    assert rates[1] == pytest.approx(4.0 / 3.0, abs=0.15) and rates[3] > 3.8


def test_graded_spans_bring_the_rate_back(tmp_path, capsys):
    assert shown(load("graded_spans").main(out=tmp_path, accuracy=0.01, levels=3))
    out = capsys.readouterr().out
    rows = re.findall(r"(uniform|graded) +(\d+) unknowns, relative L2 error (\S+)", out)
    last = {name: (int(count), float(error)) for name, count, error in rows}
    assert last["graded"][0] < last["uniform"][0] and last["graded"][1] < last["uniform"][1]
    assert "accuracy 1 % reached" in out


@pytest.mark.slow
def test_a_plate_with_a_hole_has_three_times_the_stress(tmp_path, capsys):
    assert shown(load("plate_with_hole").main(out=tmp_path))
    top, side = re.findall(r"(-?[\d.]+) at its", capsys.readouterr().out)
    assert float(top) == pytest.approx(3.0, rel=5e-3) and float(side) == pytest.approx(-1.0, rel=5e-3)


@pytest.mark.slow
def test_a_pulled_ring_of_blocks_is_near_the_formula_of_a_thick_ring(tmp_path, capsys):
    """The largest stress is at the inner side; elsewhere the beam theory itself is off by some percent of it."""
    assert shown(load("pulled_ring").main(tmp_path, iga_nn.preset("fast").scaled(0.3)))
    out = capsys.readouterr().out
    assert "4 blocks, 4 interfaces" in out and "in 4 patches: certified" in out
    found, theory = np.array(re.findall(r"(-?[\d.]+) times the force, thick ring (-?[\d.]+)", out), dtype=float).T
    assert found[0] == pytest.approx(theory[0], rel=0.03)
    assert abs(found - theory).max() < 0.05 * theory[0]
    assert shown(tmp_path / "blocks.png")


def test_own_law_has_the_rates_of_its_degree_on_any_volume(tmp_path, capsys):
    benchmark_volume(2).save(tmp_path / "volume.npz")
    assert shown(load("own_law").main(tmp_path / "volume.npz", tmp_path))
    out = capsys.readouterr().out
    assert numbers(out, r"L2 rate ([\d.]+)")[-1] == pytest.approx(4.0, abs=0.3)
    assert numbers(out, r"H1 rate ([\d.]+)")[-1] == pytest.approx(3.0, abs=0.3)


def test_heat_is_of_second_order_in_time(tmp_path, capsys):
    assert shown(load("heat").main(out=tmp_path))
    out = capsys.readouterr().out
    assert numbers(out, r"order ([\d.]+)")[-1] == pytest.approx(2.0, abs=0.05)
    assert numbers(out, r"error (\S+)")[-1] < 2e-5


def test_vibration_near_beam_theory(tmp_path, capsys):
    assert shown(load("vibration").main(out=tmp_path))
    out = capsys.readouterr().out
    frequencies = numbers(out, r"frequency (\S+)")
    assert len(frequencies) == 4 and max(numbers(out, r"residual (\S+)")) < 1e-4
    assert frequencies[:2] == pytest.approx(2 * numbers(out, r"theory (\S+)"), rel=0.01)  # both ways to bend


def test_thermal_stress_near_free_expansion(tmp_path, capsys):
    assert shown(load("thermal_stress").main(out=tmp_path))
    out = capsys.readouterr().out
    assert numbers(out, r"T = ([\d.]+)") == pytest.approx([4.0])  # heat of 1/2 along a length of 8
    assert numbers(out, r"moved by (\S+),") == pytest.approx(numbers(out, r"expansion (\S+)"), rel=0.01)


def test_convection_diffusion_has_the_rates_of_its_degree(tmp_path, capsys):
    assert shown(load("convection_diffusion").main(out=tmp_path))
    out = capsys.readouterr().out
    assert numbers(out, r"L2 rate ([\d.]+)")[-1] == pytest.approx(4.0, abs=0.3)
    assert max(numbers(out, r"(\d+) iterations of GMRES")) < 30


def test_nonlinear_conductivity_is_kirchhoffs(tmp_path, capsys):
    assert shown(load("nonlinear_conductivity").main(out=tmp_path))
    out = capsys.readouterr().out
    residuals = numbers(out, r"residual (\S+)")
    assert len(residuals) < 10 and residuals[-1] < 1e-10 and residuals[-2] < 10.0 * residuals[-3] ** 2
    assert numbers(out, r"- w\|: (\S+) of")[0] < 5e-3


def test_large_strains_shorten_the_way_of_a_beam(tmp_path, capsys):
    assert shown(load("large_strain").main(out=tmp_path))
    out = capsys.readouterr().out
    small, large = numbers(out, r"sinks by ([\d.]+)")
    assert 0.8 * small < large < 0.95 * small
    assert numbers(out, r"back by ([\d.]+)") == [0.0, pytest.approx(3.0 / 5.0 * large**2 / 8.0, rel=0.15)]


@pytest.mark.parametrize("name", [*load("gallery").EQUATIONS, "common"])
def test_scripts_on_equations_are_short(name):
    assert len((EXAMPLES / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 65  # some with formulas


def test_batch_goes_on_after_a_refused_file(formula_map, in_this_process, in_folder, tmp_path, capsys):
    picture = load("batch").main(("nowhere.obj", "bean"), tmp_path)
    assert imread(picture).std() > 0.05
    rows = list(csv.DictReader((tmp_path / "batch.csv").open()))
    assert [row["state"] for row in rows] == ["refused", "certified"] and float(rows[1]["l2_relative"]) > 0.0
    assert "nowhere.obj: refused, " in capsys.readouterr().out


def test_gallery_names_every_example_and_its_pictures_are_small():
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    for name in load("gallery").runs(full=False):
        assert f"({name}.py)" in text and (EXAMPLES / f"{name}.py").exists()
    pictures = re.findall(r"\((pictures/\w+\.png)\)", text)
    assert len(pictures) == len(load("gallery").runs(full=False))
    for picture in pictures:
        assert (EXAMPLES / picture).stat().st_size < 60_000


def test_pictures_are_kept_small(tmp_path):
    load("gallery").keep(EXAMPLES / "pictures" / "seashell.png", tmp_path / "small.png")
    assert imread(tmp_path / "small.png").shape[1] == 640 and (tmp_path / "small.png").stat().st_size < 60_000


@pytest.mark.pictures
def test_notebook_runs_and_its_results_show_themselves(in_folder, short_training):
    cells = json.loads((EXAMPLES / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    space = {}
    shown = [last_value(source, space) for source in sources if ".plot(" not in source or can_draw()]
    assert isinstance(space["surface"], iga_nn.Surface) and space["solution"].report.converged
    tables = [value._repr_html_() for value in shown if isinstance(value, Shown)]
    assert len(tables) == 6 and all("<table>" in table for table in tables)
    assert space["grid"].volume == pytest.approx(space["surface"].volume, rel=0.1)
    (low, high), (first, last) = space["grid"].bounds[:2], space["half"].bounds[:2]  # folded: no half of the volume
    assert (first, last) == pytest.approx((low, 0.5 * (low + high)))


def last_value(source, space):
    """Run a cell as a notebook does: the value of its last line is what is shown."""
    *before, last = ast.parse(source).body
    if not isinstance(last, ast.Expr):
        before, last = [*before, last], ast.Expr(ast.Constant(None))
    exec(compile(ast.Module(before, []), "notebook", "exec"), space)  # our own text
    return eval(compile(ast.Expression(last.value), "notebook", "eval"), space)


@pytest.mark.slow
def test_convergence_rates(tmp_path, capsys, monkeypatch):
    """Without degree 6, for which kernels would be compiled that no other test needs."""
    script = load("convergence")
    raised = script.raise_degree
    monkeypatch.setattr(script, "raise_degree", lambda degrees: raised(degrees[:-1]))
    studies = script.main(["--out", str(tmp_path), "--degrees", "2", "3", "--levels", "3"])
    for degree, rows in studies["h"].items():
        assert degree + 0.9 < rows[-1].rate_l2 < degree + 1.3
        assert degree - 0.1 < rows[-1].rate_h1 < degree + 0.3
    p, k = (studies[name] for name in studies if "refinement" in name)
    assert p[3][0].report.l2 == pytest.approx(k[3][0].report.l2)  # where both start: one space
    assert [rows[0].report.dofs for rows in k.values()] == [7**3, 8**3, 9**3]  # C^(degree - 1) on 4^3 elements
    assert [rows[0].report.dofs for rows in p.values()] == [7**3, 11**3, 15**3]  # C^2: a knot more each
    for study in (p, k):
        errors = [rows[0].report.l2 for rows in study.values()]
        assert all(b < a / 5 for a, b in pairwise(errors))
    assert {file.name for file in tmp_path.iterdir()} == {
        "convergence.csv",
        "convergence.png",
        "orders.csv",
        "orders.png",
    }
    assert "degree  elements  unknowns" in capsys.readouterr().out


def test_validation_runs_what_is_there_and_keeps_the_row_of_what_is_not(formula_training, in_folder, capsys):
    formula_training()
    Path("models").mkdir()
    main(["sample", "ellipsoid", "--out", "models/conch.obj"])
    assert load("benchmarks/validation").main(["--models", "models", "--out", "out", "--steps-factor", "0.1"]) == 0
    text = Path("out/validation.md").read_text()
    assert text.strip() in capsys.readouterr().out
    assert "| conch | paper | 1 | 1.468 | 50.818 | 0.00169 | - | - |" in text
    assert "| horse_default | ours | not found" in text
    assert "| horse_default | paper | 190.73 | 39.71 | 230.44 |" in text
    assert "| santa4 | ours | model not public |" in text
    assert "| santa4 | paper | 194.23 | 38.71 | 232.93 |" in text
    assert "no measurement" in text
    assert text.count("| conch | 0 | 343 |") == 1 and "![error](conch/figure14.png)" in text


def test_a_model_with_a_fault_fails_the_validation():
    faults = load("benchmarks/validation")._faults
    quality = {"bijective": "certified", "boundary_injective": True}
    report = {"parameterization": quality, "poisson": {"levels": [{"l2_relative": 1e-3}, {"l2_relative": 9e-5}]}}
    assert faults("conch", report) == [] and faults("santa4", "model not public") == []
    assert faults("conch", "run failed") == ["conch: run failed"]
    quality["boundary_injective"] = False
    report["poisson"]["levels"][1]["l2_relative"] = 3e-4
    assert faults("conch", report) == [
        "conch: certified, one-to-one: no",
        "conch: relative L2 error 3.0e-04, larger than 2e-04",
    ]


@pytest.mark.slow
def test_part_from_cad_is_certified_and_balanced(tmp_path, capsys):
    load("cad_part").main(tmp_path)
    said = capsys.readouterr().out
    assert "certified" in said and "balanced" in said
