"""A run on a surface whose map has several blocks: the folder, the page, regions of the surface, a batch, two runs."""

import json

import numpy as np
import pytest
from blocks import mapped_to, outer_surface
from conftest import found_once, told
from patches import SYMMETRIES, patch, turned

from iga_nn.cli.commands import main
from iga_nn.figures import render as rendering
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.spline.body import Body
from solve.field import BodyField


def bent_ell():
    """An L of three cubes, a little bent, whose parameters run in different ways."""

    def cube(a, b, symmetry):
        def place(u, v, w):
            x, y = a + u, b + v
            return x + 0.05 * np.sin(y), y, w + 0.05 * x * y

        return turned(patch(place, 4), symmetry)

    return Body.from_patches([cube(0, 0, SYMMETRIES[0]), cube(1, 0, SYMMETRIES[21]), cube(0, 1, SYMMETRIES[38])])


def write_surface(path, body):
    """The outer faces as an OBJ file, those at y = 0 and y = 2 as groups."""
    outer = outer_surface(body)
    middles = outer.vertices[outer.faces].mean(axis=1)
    groups = np.select([middles[:, 1] < 1e-9, middles[:, 1] > 2.0 - 1e-9], ["foot", "end"], "rest")
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in outer.vertices.tolist()]
    for name in ("foot", "end", "rest"):
        lines += [f"g {name}", *(f"f {a} {b} {c}" for a, b, c in (outer.faces[groups == name] + 1).tolist())]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def on_blocks(in_folder, monkeypatch, few_distances):
    """The surface ell.obj, and in place of the training the body it was sampled from."""
    body = bent_ell()
    write_surface(in_folder / "ell.obj", body)
    for name, kept in found_once().items():
        monkeypatch.setattr(name, kept)

    def parameterize(surface, *_, seed, when_made, **__):
        return told(mapped_to(body, surface, seed), when_made)

    monkeypatch.setattr("parameterize.run.parameterize", parameterize)
    return body


def report_of(folder):
    return json.loads((folder / "report.json").read_text())


def test_a_run_on_blocks_solves_and_tells_what_they_distort(on_blocks, in_folder, capsys):
    assert main(["run", "poisson", "ell.obj", "--exact=x*y+z", "--refine", "0", "1", "--out", "out"]) == 0
    said, report = capsys.readouterr().out, report_of(in_folder / "out")
    facts, levels = report["parameterization"], report["poisson"]["levels"]
    assert "own boxes        ARAP" in said and "as_given" not in said and "one-to-one: yes" in said
    assert len(facts["patches"]) == 3 and len(facts["interfaces"]) == 2 and facts["origin"] == "growth"
    weights = [part["volume"] for part in facts["patches"]]
    mean = np.average([part["arap"]["mean"] for part in facts["patches"]], weights=np.abs(weights))
    assert facts["arap"]["as_given"]["mean"] == pytest.approx(mean)
    assert facts["surface_distance"]["two_sided"]["of_diagonal"]["rms"] < 2e-3
    assert levels[1]["l2_relative"] < levels[0]["l2_relative"] < 1e-3
    assert len(Body.load(in_folder / "out" / "volume.npz")) == 3
    assert len(BodyField.load(in_folder / "out" / "solution.npz").patches) == 3
    boundary = BoundaryMap.load(in_folder / "out" / "boundary.npz")
    assert on_blocks.points(boundary.patches, boundary.parameters) == pytest.approx(boundary.vertices, abs=1e-12)
    page = (in_folder / "out" / "report.html").read_text()
    assert "each block in its own box" in page and "least scaled det J" in page and "2 interfaces, 14 outer" in page


def test_regions_of_the_surface_hold_on_blocks(on_blocks, in_folder):
    """A bar of E = 1 held at its foot and pulled at its end: loads and reactions are those of the groups' areas."""
    given = ["--fix", "group:foot", "--load", "group:end=0;1;0", "--refine", "0", "--out", "out"]
    assert main(["run", "elasticity", "ell.obj", *given]) == 0
    section = report_of(in_folder / "out")["elasticity"]
    areas = {region["region"]: region["area"] for region in section["regions"]}
    part = BoundaryMap.load(in_folder / "out" / "boundary.npz").part
    for name in ("foot", "end"):
        assert areas[f"group:{name}"] == pytest.approx(part.area(part.group(name)), rel=1e-3)
    assert section["levels"][0]["load"] == pytest.approx([0.0, areas["group:end"], 0.0], abs=1e-9)
    assert section["levels"][0]["imbalance"] < 1e-8
    again = ["out/volume.npz", "--fix", "group:foot", "--load", "group:end=0;1;0", "--refine", "0", "--out", "again"]
    assert main(["solve", "elasticity", *again]) == 0
    assert report_of(in_folder / "again")["elasticity"]["levels"][0]["load"] == section["levels"][0]["load"]


def test_a_finished_run_on_blocks_is_found_again_compared_and_exported(on_blocks, in_folder, capsys):
    for out, level in (("one", "0"), ("two", "1")):
        assert main(["run", "poisson", "ell.obj", "--refine", level, "--out", out]) == 0
    before = (in_folder / "one" / "volume.npz").read_bytes()
    capsys.readouterr()
    assert main(["run", "poisson", "ell.obj", "--refine", "0", "--out", "one", "--resume"]) == 0
    assert "finished already" in capsys.readouterr().err and (in_folder / "one" / "volume.npz").read_bytes() == before
    assert main(["compare", "one", "two"]) == 0
    assert "ARAP distortion of own boxes, mean" in capsys.readouterr().out
    for kind in ("gismo", "mfem", "vtk", "view"):
        assert main(["export", "one/volume.npz", "--to", kind]) == 0


def test_a_batch_has_a_row_for_blocks(on_blocks, in_folder, in_this_process):
    assert main(["batch", "ell.obj", "--out", "all", "--refine", "0"]) == 0
    (row,) = json.loads((in_folder / "all" / "batch.json").read_text())["surfaces"]
    assert row["state"] == "certified" and row["arap"]["unit_volume"]["mean"] > 0.0


def test_blocks_without_a_proof_are_told_with_their_places(on_blocks, in_folder, monkeypatch, capsys):
    net = on_blocks.patches[1].control_points
    net[2, 2, 2] += 3.0  # inside: the outer faces and the interfaces stay
    assert main(["parameterize", "ell.obj", "--out", "out"]) == 3
    said, facts = capsys.readouterr().out, report_of(in_folder / "out")["parameterization"]
    assert facts["bijective"] == "folded" and facts["patches"][1]["bijective"] == "folded"
    assert facts["unproved"]["spans"] == facts["patches"][1]["unproved"]["spans"] > 0
    assert "more control points: --control-points 40" in said and "--corners" not in said and "--seed" not in said
    assert "not proved       on" in said


@pytest.mark.pictures
def test_pictures_of_blocks(on_blocks, in_folder):
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")
    assert main(["parameterize", "ell.obj", "--out", "out"]) == 0
    assert "not_drawn" not in report_of(in_folder / "out")
    for name in ("faces", "blocks", "lines", "cut", "distortion"):
        assert (in_folder / "out" / f"{name}.png").stat().st_size > 5000
    assert "The blocks drawn apart" in (in_folder / "out" / "report.html").read_text()
