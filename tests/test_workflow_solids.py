"""A STEP file of two solids that touch becomes one body, which is solved with a material each."""

import json

import pytest
from step_files import Step

import iga_nn
from iga_nn.cli.commands import main


@pytest.mark.slow
def test_two_solids_of_a_step_file_are_pulled(in_folder):
    """A bar of steel and rubber under traction 1: its end moves by 1 / 210000 + 1 / 8."""
    step = Step()
    step.part(step.box((1, 1, 1), (0, 0, 0), "steel"), step.box((1, 1, 1), (1, 0, 0), "rubber pad"))
    (in_folder / "bar.step").write_bytes(step.data())
    given = ["--young", "steel: 210000, rubber pad: 8", "--poisson-ratio", "0", "--refine", "0"]
    held = ["--fix", "group:steel and nx < -0.9", "--load", "group:'rubber pad' and nx > 0.9=1;0;0"]
    assert main(["run", "elasticity", "bar.step", *given, *held, "--out", "bar"]) == 0
    report = json.loads((in_folder / "bar" / "report.json").read_text())
    solids = report["parameterization"]["solids"]
    assert [solid["name"] for solid in solids] == ["steel", "rubber pad"]
    assert [solid["volume"] for solid in solids] == pytest.approx([1.0, 1.0])
    largest = report["elasticity"]["levels"][0]["extremes"]["magnitude"]["largest"]
    assert largest == pytest.approx(1.0 / 210000.0 + 1.0 / 8.0, rel=1e-6)
    assert iga_nn.load_volume("bar/volume.npz").solids.labels == ("steel", "rubber pad")
