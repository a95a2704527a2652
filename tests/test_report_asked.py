"""Asked quantities are shown first, with as many digits as their interval leaves."""

import json
from pathlib import Path

import pytest

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.report import asked
from iga_nn.report.notebook import as_html
from solve import Answer, benchmark_volume


def report(*answers, **units):
    return {"elasticity": {"asked": [answer.as_dict() for answer in answers], "levels": [], **units}}


@pytest.mark.parametrize(
    ("value", "lower", "upper", "shown"),
    [
        (-0.0123456, -0.01253, -0.01212, "-0.01235, between -0.01253 and -0.01212 (± 1.7 %)"),
        (2275.4, 1810.0, 2741.0, "2280, between 1810 and 2750 (± 20 %)"),
        (1e-9, 0.97e-9, 1.03e-9, "1.000e-09, between 9.70e-10 and 1.030e-09 (± 3 %)"),
        (0.0, -2e-7, 2e-7, "0, between -2.0e-07 and 2.0e-07"),
        (4.5, 4.5, 4.5, "4.5, exact to rounding"),
        (239.99999999, 239.999999968, 240.000000012, "240, exact to 1e-10"),
        (0.187384, 0.187379, 0.187389, "0.18738, between 0.18737 and 0.18739 (± 0.0027 %)"),
        (10.0, -1.0, 21.0, "10, between -1 and 21 (± 110 %)"),
        (5.0, -900.0, 910.0, "5, between -900 and 910"),
    ],
)
def test_numbers_have_the_digits_of_their_interval(value, lower, upper, shown):
    (line,) = asked.lines(report(Answer("uz max", value, lower, upper, why="")))
    assert line == f"uz max = {shown}"


def test_ends_are_rounded_outwards():
    (line,) = asked.lines(report(Answer("u max", 1.0, 0.98749, 1.01251, why="")))
    assert "between 0.987 and 1.013" in line


def test_units_follow_what_is_measured():
    answers = [Answer("a", 2.0, dimension=kind) for kind in ("length", "stress", "force", "energy", "")]
    lines = asked.lines(report(*answers, unit="mm", stress_unit="MPa"))
    assert [line.partition(",")[0] for line in lines] == ["a = 2 mm", "a = 2 MPa", "a = 2 N", "a = 2 N·mm", "a = 2"]
    assert asked.lines(report(Answer("a", 2.0, dimension="force"), unit="mm"))[0].startswith("a = 2, no interval")


def test_a_line_says_where_and_why():
    found = Answer("u max", 2.0, 1.9, 2.1, "two degrees", {"discretization": 0.08, "geometry": 0.02}, (1.0, 0.0, 2.0))
    (line,) = asked.lines(report(found, unit="mm"))
    assert line.endswith("(± 5 %): at (1, 0, 2) mm; two degrees; discretization ± 0.08, geometry ± 0.02")


def test_a_solve_shows_what_was_asked_first(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    asks = ["--ask", "u at (0.5, 0.5, 0.5)", "flow over u1"]
    assert main(["solve", "poisson", "map.npz", "--exact", "x*y*z", *asks, "--out", "out"]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("asked            u at (0.5, 0.5, 0.5) = 0.125")
    section = json.loads(Path("out/report.json").read_text())["poisson"]
    assert list(section)[0] == "asked" and section["ask"] == asks[1:]
    assert [answer["ask"] for answer in section["asked"]] == asks[1:]
    assert section["asked"] == section["levels"][-1]["asked"] != section["levels"][0]["asked"]
    for name in ("value", "lower", "upper", "why"):
        assert name in section["asked"][0]
    page = Path("out/report.html").read_text()
    assert page.index("What was asked") < page.index("In short") and "flow over u1" in page
    assert main(["compare", "out", "out"]) == 0
    assert "u at (0.5, 0.5, 0.5)" in capsys.readouterr().out
    assert main(["solve", "poisson", "map.npz", *asks, "--out", "out", "--force", "--json"]) == 0
    assert [answer["ask"] for answer in json.loads(capsys.readouterr().out)["asked"]] == asks[1:]


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        ([""], "ask '': is empty; write"),
        (["ux max"], "ask 'ux max': Poisson gives no 'ux'"),
        (["u max", "u  max"], "ask 'u max': is asked twice"),
        (["frequency 1"], "of modes"),
        (["u at (9, 9, 9)"], "lies outside of the body"),
        (["mean u over nz > 2"], "no part of the boundary lies there"),
    ],
)
def test_a_bad_ask_costs_no_folder(in_folder, capsys, ask, message):
    benchmark_volume(2).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--ask", *ask, "--out", "out"]) == 2
    told = capsys.readouterr().err.splitlines()
    assert message in told[-1] and not Path("out").exists()


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        ("u at (9, 9, 9)", "lies outside of the part, 13.86"),
        ("u max over x > 9", "no point of the surface lies there"),
        ("mean u over nz > 2", "no point of the surface lies there"),
    ],
)
def test_an_ask_is_checked_before_the_map_is_made(in_folder, formula_training, ask, message):
    with pytest.raises(InputError, match=message):
        iga_nn.run("poisson", "cube", "out", poisson=iga_nn.PoissonOptions(ask=(ask,)))


def test_a_notebook_shows_it_above_the_solve():
    text = as_html(iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x"), ask=["u max"]))
    assert text.index("u max") < text.index("unknowns")


def test_frequencies_are_asked_of_modes(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    modes = ["modes", "map.npz", "--fix", "u0", "--number", "2", "--out", "out"]
    assert main([*modes, "--ask", "frequency 2"]) == 0
    assert capsys.readouterr().out.startswith("frequency 2 = ")
    found = json.loads(Path("out/report.json").read_text())["modes"]
    assert found["asked"][0]["value"] == found["frequencies"][1]
    for ask, message in (("frequency 3", "2 modes are sought"), ("ux max", "only frequencies are asked")):
        assert main([*modes, "--force", "--ask", ask]) == 2
        assert message in capsys.readouterr().err
