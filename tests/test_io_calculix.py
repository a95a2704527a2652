"""Tests iga_nn.io.calculix: what the file says, and, where ccx is at hand, the answer of CalculiX."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from example_files import load

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.io.calculix import Deck, write_calculix
from iga_nn.io.element_proof import proved, unproved
from iga_nn.io.element_shapes import C3D8, C3D20, SHAPES
from iga_nn.io.elements import Elements, cut
from parameterize.spline.body import Body, as_body
from solve import benchmark_volume

calculix = load("benchmarks/calculix")

CCX = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


def block(low, high, flip=False):
    """Return a box; flip: left-handed."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)

    def point(u, v, w):
        w = 1.0 - w if flip else w
        return tuple(low[a] + (high[a] - low[a]) * t for a, t in enumerate((u, v, w)))

    return iga_nn.BSplineVolume.from_function(point, control_points=5, degree=2)


def bar():
    """Return two boxes beside each other, the second of which is left-handed, of two solids."""
    return Body.from_patches([block((0, 0, 0), (2, 1, 1)), block((2, 0, 0), (4, 1, 1), flip=True)], solids=("a", "b"))


def solved_by_ccx(folder, name):
    """Run ccx in a folder and return the path of its results."""
    done = subprocess.run(["ccx", "-i", name], cwd=folder, capture_output=True, text=True, check=False)
    assert "ERROR" not in done.stdout and "nonpositive" not in done.stdout, done.stdout[-2000:]
    return Path(folder) / f"{name}.frd"


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_functions_of_nodes_are_one_at_their_node_and_sum_to_one(shape):
    ends = 2.0 * shape.nodes / shape.degree - 1.0
    assert np.allclose(shape.functions(ends), np.eye(len(ends)))
    local = np.random.default_rng(0).uniform(-1, 1, (7, 3))
    assert np.allclose(shape.functions(local).sum(axis=1), 1.0)
    linear = shape.functions(local) @ ends
    assert np.allclose(linear, local)


def test_elements_share_nodes_and_lie_on_the_map():
    elements = Elements.of(bar(), 2, cut(bar(), 2))
    assert len(np.unique(elements.points.round(9), axis=0)) == len(elements.points)
    patches, parameters = elements.place_of_nodes
    assert np.allclose(elements.body.points(patches, parameters), elements.points)
    assert not len(unproved(elements.points, C3D20.chosen(elements.cells), C3D20))
    inside = elements.holding(elements.owners, 0.5 * (elements.low + elements.high))
    assert np.array_equal(inside, np.arange(len(elements)))


def test_elements_that_fold_are_halved_with_what_is_tied_to_them():
    def turned(u, v, w):  # a bend of 170 degrees in a single span, whose C3D20 folds
        angle = 5.6 * u
        return (0.3 + v) * np.cos(angle), (0.3 + v) * np.sin(angle), w

    body = as_body(iga_nn.BSplineVolume.from_function(turned, control_points=4))
    start = Elements.of(body, 1, cut(body, 1))
    assert len(unproved(start.points, C3D8.chosen(start.cells), C3D8))
    elements, halved = proved(start, C3D8)
    assert halved == 1 and len(elements) == 8
    assert not len(unproved(elements.points, C3D8.chosen(elements.cells), C3D8))


def test_an_inverted_element_is_not_proved():
    points = np.array(C3D8.nodes, dtype=float)
    cells = np.arange(8)[None]
    assert not len(unproved(points, cells, C3D8))
    points[6] = 0.1  # corners stay, the element folds
    assert len(unproved(points, cells, C3D8)) == 1


def test_forces_at_nodes_have_the_resultant_of_the_solve():
    problem = iga_nn.Elasticity(
        young={"a": 100.0, "b": 50.0}, fix="nx < -0.9", load={"nx > 0.9": ("y", 0, "1")}, body_force=(0, "x", 0)
    )
    deck = Deck.of(bar(), problem)
    assert np.allclose(deck.forces.sum(axis=0), [0.5, 8.0, 1.0], atol=1e-12)
    solution = iga_nn.solve(bar(), problem, refine=0)
    assert np.allclose(deck.forces.sum(axis=0), solution.report.balance.load, atol=1e-10)
    assert len(deck.lines) == 2 and deck.named["FIX_1"][0].size == 9


def test_totals_gravity_and_moments_are_those_of_the_problem():
    remote = {"nx > 0.9": ((0, 0, -500), (10, 0, 50))}
    problem = iga_nn.Elasticity(density=2.0, gravity=(0, 0, -10), fix="nx < -0.9", total_force={"nx > 0.9": (0, 7, 0)})
    assert np.allclose(Deck.of(bar(), problem).forces.sum(axis=0), [0, 7, -80], atol=1e-10)
    deck = Deck.of(bar(), iga_nn.Elasticity(material="steel", fix="nx < -0.9", remote_force=remote))
    moment = np.cross(deck.elements.points, deck.forces).sum(axis=0)
    assert np.allclose(moment, np.cross((10, 0, 50), (0, 0, -500)), atol=1e-8)
    assert deck.lines == [["*ELASTIC", "2.100000000000e+05, 3.000000000000e-01", "*DENSITY", "7.850000000000e-09"]]


def test_supports_are_independent_equations_at_nodes():
    problem = iga_nn.Elasticity(
        fix={"nx < -0.9": (0, None, None)}, roller="ny < -0.9 or nz < -0.9", body_force=(1, 0, 0)
    )
    deck = Deck.of(bar(), problem)
    held = {}
    for node, terms, value in deck.held.rows:
        assert len(terms) == 1 and value == 0.0
        held.setdefault(node, set()).add(terms[0][0])
    corner = int(np.flatnonzero((np.abs(deck.elements.points) < 1e-12).all(axis=1))[0])
    assert held[corner] == {0, 1, 2}


def test_a_roller_on_a_slanted_face_is_an_equation(tmp_path):
    body = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + 0.5 * v, v, w), control_points=4)
    problem = iga_nn.Elasticity(fix="v0", roller="u0 or u1", load={"v1": (0, -1, 0)})
    write_calculix(tmp_path / "slanted.inp", body, problem)
    text = (tmp_path / "slanted.inp").read_text().splitlines()
    at = text.index("*EQUATION")
    assert text[at + 1] == "2" and len(text[at + 2].split(",")) == 6
    assert all(len(word.strip()) <= 20 for row in text[2:] if not row.startswith("*") for word in row.split(","))


@CCX
def test_ccx_gives_the_displacement_of_a_bar(tmp_path):
    problem = iga_nn.Elasticity(
        young={"a": 100.0, "b": 50.0}, poisson_ratio=0.0, fix="nx < -0.9", load={"nx > 0.9": (1, 0, 0)}
    )
    deck = write_calculix(tmp_path / "bar.inp", bar(), problem)
    found = calculix.values(solved_by_ccx(tmp_path, "bar"), deck)
    x = deck.elements.points[:, 0]
    exact = np.where(x < 2.0, x / 100.0, 0.02 + (x - 2.0) / 50.0)
    used = deck.numbers > 0
    assert np.allclose(found[used, 0], exact[used], rtol=1e-5)


@CCX
@pytest.mark.parametrize(("element", "within"), [("C3D20", 0.01), ("C3D20R", 0.01), ("C3D8", 0.1)])
def test_ccx_agrees_with_the_solve_on_a_curved_body(tmp_path, element, within):
    body = benchmark_volume(4, amplitude=0.1)
    problem = iga_nn.Elasticity(young=210.0, fix="u0", pressure={"u1": 1}, body_force=(0, 0, "-x"))
    solution = iga_nn.solve(body, problem, refine=1)
    deck = write_calculix(tmp_path / "wavy.inp", body, problem, parts=2, element=element)
    found = calculix.values(solved_by_ccx(tmp_path, "wavy"), deck)
    patches, parameters = deck.elements.place_of_nodes
    used = deck.numbers > 0
    ours = solution(parameters)
    largest = np.linalg.norm(ours, axis=1).max()
    assert np.abs(np.linalg.norm(found[used], axis=1).max() - largest) < within * largest


@CCX
def test_ccx_agrees_with_the_solve_of_heat(tmp_path):
    problem = iga_nn.Poisson(
        kappa={"a": "2", "b": "5"},
        source="1",
        conditions=[iga_nn.Flux("nx < -0.9", 3), iga_nn.Exchange("nx > 0.9", 4, 20)],
    )
    solution = iga_nn.solve(bar(), problem, refine=1)
    deck = write_calculix(tmp_path / "heat.inp", bar(), problem)
    found = calculix.values(solved_by_ccx(tmp_path, "heat"), deck)[:, 0]
    patches, parameters = deck.elements.place_of_nodes
    ours = np.array([solution.patches[p](one[None])[0] for p, one in zip(patches, parameters, strict=True)])
    used = deck.numbers > 0
    assert np.allclose(found[used], ours[used], rtol=2e-5)


REFUSED = [
    (iga_nn.Elasticity(fix="u0", spring={"u1": 3.0}, load={"v0": (0, 0, 1)}), "spring 'u1' is not written"),
    (iga_nn.Elasticity(material="steel", temperature_change=9, fix="u0"), "temperature_change is not written"),
    (iga_nn.Poisson(kappa="1+x", conditions=[iga_nn.Value("u0", "1")]), "kappa varies on patch 0"),
    (iga_nn.Poisson(reaction="1", conditions=[iga_nn.Value("u0", "1")]), "reaction is not written"),
]


@pytest.mark.parametrize(("problem", "message"), REFUSED, ids=["spring", "temperature", "kappa", "reaction"])
def test_what_is_not_written_is_refused_by_name(problem, message):
    with pytest.raises(InputError, match=message):
        Deck.of(benchmark_volume(2), problem)


def test_a_run_is_exported_with_its_problem(tmp_path, monkeypatch, capsys, caplog):
    monkeypatch.chdir(tmp_path)
    benchmark_volume(2).save("volume.npz")
    solve = ["solve", "elasticity", "volume.npz", "--refine", "0", "--out", "pulled"]
    assert main([*solve, "--fix", "u0", "--load", "u1=1;0;0"]) == 0
    assert main(["export", "pulled", "--to", "calculix", "--element", "C3D20R"]) == 0
    text = Path("pulled.inp").read_text()
    assert "TYPE=C3D20R" in text and "*CLOAD" in text and "NAME=FIX_1" in text
    assert main(["export", "pulled", "--to", "gismo"]) == 0
    assert Path("pulled_u.xml").is_file()
    assert main(["export", "pulled", "--to", "calculix", "--element", "C3D10", "--force"]) == 2
    assert "choose one of C3D20, C3D20R, C3D8" in capsys.readouterr().err
    assert main(["export", "volume.npz", "--to", "calculix"]) == 0
    assert "no solution with a known problem: the file has mesh and sets" in caplog.text
    assert "*STEP" not in Path("volume.inp").read_text()
    Path("empty").mkdir()
    assert main(["export", "empty", "--to", "calculix"]) == 2
    assert "is a folder: name the volume.npz in it" in capsys.readouterr().err
