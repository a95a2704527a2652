"""STEP and IGES by OpenCASCADE; without it one line says what to install.

data/bracket.step, made with OpenCASCADE 7.8: an L of a foot 60 x 40 x 10 and a wall 10 x 40 x 50, in millimetres, with
a hole of radius 8 through the foot.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from scene_files import solid_model

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.report import document as report
from iga_nn.workflow.regions import check_regions
from parameterize.surface.readers import cad
from parameterize.surface.surface import MeshError, load_surface

VOLUME = 6 * 4 * 1 + 1 * 4 * 4 + 0.5 * pi * 2**2  # foot, wall, half a disc at the end
BRACKET = Path(__file__).parent / "data" / "bracket.step"
BACK, FRONT, HOLE = "group:face1", "group:face8", "group:face9"
NAMES = {"MM": "mm", "INCH": "in", "M": "m"}


@pytest.fixture(scope="module")
def part():
    """The bytes of a bracket by kind and unit."""
    pytest.importorskip("OCP")
    return solid_model


@pytest.mark.parametrize(("kind", "unit"), [("step", "MM"), ("step", "INCH"), ("step", "M"), ("iges", "INCH")])
def test_a_bracket_keeps_its_unit_and_its_faces(kind, unit, part, tmp_path):
    path = tmp_path / f"bracket.{kind}"
    path.write_bytes(part(kind, unit))
    surface = load_surface(path)
    assert surface.unit == NAMES[unit] and surface.volume == pytest.approx(VOLUME, rel=1e-3)
    assert np.allclose(surface.bbox, [[0, 0, 0], [8, 4, 5]], atol=1e-9)
    areas = [surface.part.area(faces) for faces in surface.groups.values()]
    assert sum(areas) == pytest.approx(surface.part.area(np.arange(len(surface.faces))))
    assert min(abs(np.array(areas) - 1 * 4)) < 1e-9  # the top of the wall


def test_a_bracket_with_a_hole_has_a_handle_and_its_faces_by_name():
    pytest.importorskip("OCP")
    surface = load_surface(BRACKET)
    assert surface.genus == 1 and surface.unit == "mm" and len(surface.groups) == 9
    assert surface.volume == pytest.approx(60 * 40 * 10 + 10 * 40 * 40 - 10 * pi * 8**2, rel=1e-3)
    areas = [surface.part.area(surface.groups[name.removeprefix("group:")]) for name in (BACK, FRONT, HOLE)]
    assert areas == pytest.approx([40 * 50, 40 * 10, 2 * pi * 8 * 10], rel=2e-3)
    check_regions(iga_nn.Elasticity(fix=BACK, load={FRONT: (0, 0, -1)}).on_surface(surface.part), surface)


@pytest.mark.slow
def test_a_bracket_with_a_hole_is_held_and_loaded_at_faces_by_name(in_folder):
    """The wall holds what pulls at the front, 40 x 10 with one unit of force each."""
    pytest.importorskip("OCP")
    options = ["--young", "200", "--fix", BACK, "--load", f"{FRONT}=0;0;-1", "--control-points", "8", "--refine", "0"]
    assert main(["run", "elasticity", str(BRACKET), *options, "--out", "out"]) == 0
    found = report.read(in_folder / "out")
    assert found["parameterization"]["bijective"] == "certified"
    areas = {row["region"]: row["area"] for row in found["elasticity"]["regions"]}
    assert areas[BACK] == pytest.approx(40 * 50, rel=0.05) and areas[FRONT] == pytest.approx(40 * 10, rel=0.05)
    reaction = found["elasticity"]["levels"][0]["reactions"][f"fix {BACK!r}"]
    assert reaction[2] == pytest.approx(areas[FRONT], rel=1e-6)


def test_deflection_is_the_distance_from_curved_faces(part, tmp_path):
    path = tmp_path / "bracket.step"
    path.write_bytes(part())
    gaps = []
    for deflection in (0.02, 0.002):
        surface = load_surface(path, deflection=deflection)
        corners = surface.vertices[surface.faces]
        radii = np.linalg.norm(corners[..., :2] - [6.0, 2.0], axis=2)
        end = corners[np.all(abs(radii - 2.0) < 1e-9, axis=1) & np.all(corners[..., 0] > 5.99, axis=1)]
        end = end[np.ptp(end[..., 2], axis=1) > 0.5]  # not those of the plane faces
        middles = 0.5 * (end + np.roll(end, 1, axis=1))  # of edges
        gaps.append(2.0 - np.linalg.norm(middles[..., :2] - [6.0, 2.0], axis=2).min())
        assert 0.0 < gaps[-1] < deflection
    assert gaps[1] < 0.5 * gaps[0]
    with pytest.raises(MeshError, match="deflection must be a positive length, got -1"):
        load_surface(path, deflection=-1.0)


def test_a_damaged_file_is_refused_in_one_line(part, tmp_path, capfd):
    path = tmp_path / "bracket.step"
    path.write_bytes(part()[:9000])
    capfd.readouterr()
    with pytest.raises(MeshError, match="bracket.step: OpenCASCADE cannot read it as STEP"):
        load_surface(path)
    assert capfd.readouterr() == ("", "")


def test_without_opencascade_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cad, "find_spec", lambda name: None)
    path = tmp_path / "part.step"
    path.write_text("ISO-10303-21;\n")
    assert main(["check", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(
        "part.step: reading .step needs OpenCASCADE, which is not installed: pip install 'iga-nn[cad]'"
    )


def test_deflection_is_for_solid_models(capsys):
    assert main(["check", "cube", "--deflection", "0.1"]) == 2
    assert "cube: deflection is for files of solid models" in capsys.readouterr().err
