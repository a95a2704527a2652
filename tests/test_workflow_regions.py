"""Data on regions from the command line: read, judged before the map is made, solved with, and told."""

import json

import numpy as np
import pytest

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.options import ElasticityOptions, PoissonOptions
from iga_nn.workflow.regions import check_regions, share_of
from solve import Elasticity, Region

PULLED = ("--fix", "face(0.5, 0.5, 0)", "--load", "nz > 0.9 and x < 0.5=0;0;2", "--young", "100")


@pytest.mark.parametrize(
    ("entry", "region", "data"),
    [
        ("x < 1", "x < 1", None),
        ("x <= 1=0;0;1", "x <= 1", ["0", "0", "1"]),
        ("x < 1 = 0;;", "x < 1", ["0", None, None]),
        ("x >= 1 and z<=2=0", "x >= 1 and z<=2", ["0", "0", "0"]),
        ('group:"a=b"=1;2;3', 'group:"a=b"', ["1", "2", "3"]),
    ],
)
def test_a_region_ends_at_the_equals_sign_that_is_no_comparison(entry, region, data):
    (found,) = ElasticityOptions(fix=(entry,), load=("nz > 0=1;0;0",)).problem().conditions[:1]
    assert str(found.region) == region
    given = [None if free else value for value, free in zip(found.data, found.free or (False,) * 3, strict=True)]
    assert [str(float(v)) if v is not None else v for v in given] == [
        str(float(v)) if v is not None else v for v in (data or ["0", "0", "0"])
    ]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (ElasticityOptions(fix=("x < 1", "x < 1")), "region 'x < 1' is given twice"),
        (ElasticityOptions(fix=("=1;0;0",)), "write a region before the ="),
        (ElasticityOptions(fix=("x < 1=1;0",)), "write three formulas"),
        (ElasticityOptions(fix=("x",), load=("y < 1=0;0;1",)), "region 'x': expression"),
        (ElasticityOptions(fix=("x < 1",), load=("y < 1",)), "load 'y < 1' has no data"),
        (ElasticityOptions(fix=("x < 1",), traction=("u0=0",)), "not both"),
        (PoissonOptions(exchange=("x < 1=2",)), "write REGION=ALPHA:OUTSIDE"),
        (PoissonOptions(value=("x < 1=q",)), "value 'x < 1': expression"),
    ],
)
def test_wrong_entries_are_refused_in_one_line(options, says):
    with pytest.raises(InputError, match=says) as caught:
        options.problem()
    assert "\n" not in str(caught.value)


def test_a_run_holds_and_loads_faces_of_the_part(formula_training, in_folder, capsys, coarse_regions):
    formula_training()
    assert main(["run", "elasticity", "cube", *PULLED, "--refine", "0", "--out", "out", "--quiet"]) == 0
    level = json.loads((in_folder / "out" / "report.json").read_text())["elasticity"]["levels"][0]
    area = level["areas"]["load 'nz > 0.9 and x < 0.5'"]  # half of the top of a map by formula, which bulges
    assert area == pytest.approx(0.5, abs=0.1) and level["load"] == pytest.approx([0.0, 0.0, 2.0 * area], abs=1e-9)
    (reaction,) = level["reactions"].values()
    assert np.add(level["load"], reaction) == pytest.approx([0.0, 0.0, 0.0], abs=1e-8)
    assert level["imbalance"] < 1e-8
    # the volume knows the part again by the boundary.npz beside it
    assert main(["solve", "elasticity", "out/volume.npz", *PULLED, "--refine", "0", "--out", "again", "--quiet"]) == 0
    again = json.loads((in_folder / "again" / "report.json").read_text())["elasticity"]["levels"][0]
    assert again["reactions"] == level["reactions"]
    (in_folder / "out" / "boundary.npz").unlink()
    capsys.readouterr()
    assert main(["solve", "elasticity", "out/volume.npz", *PULLED, "--out", "third", "--quiet"]) == 2
    assert "boundary.npz: is not there" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("region", "says"),
    [
        ("z > 5", "no point of the surface lies there; x runs from 0 to 1"),
        ("group:inlet", "group 'inlet' does not exist"),
        ("nz > 2", "no point of the surface lies there"),
    ],
)
def test_a_region_that_is_not_on_the_part_is_refused_before_the_map_is_made(region, says, in_folder, capsys):
    code = main(["run", "elasticity", "cube", "--fix", "nz < -0.9", "--load", f"{region}=0;0;1", "--quiet"])
    assert code == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1 and not (in_folder / "cube").exists()


def test_shares_of_a_surface_are_those_of_its_area():
    cube = iga_nn.sample("cube")
    assert share_of(Region("nz > 0.9"), cube) == pytest.approx(1.0 / 6.0, abs=0.01)
    assert share_of(Region("z > 0.5"), cube) == pytest.approx(0.5, abs=0.015)
    assert share_of(Region("z > 5"), cube) == 0.0
    corner = share_of(Region("x + y + z < 1e-6"), cube)
    assert 0.0 < corner < 1e-4
    check_regions(Elasticity(fix="u0", load={"z > 0.9": (0, 0, 1)}), cube)  # of the cube's faces nothing is known yet


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["elasticity", "--young", "steel: 1, pad: 2"], "young: there is no solid 'pad'; the body has steel, solid2"),
        (["elasticity", "--young", "steel: 1"], "young has no entry for solid 'solid2'; the body has steel, solid2"),
        (
            ["poisson", "--kappa", "steel: 1, solid2: z-1.5", "--source", "1"],
            "kappa must be positive, and is not at x=0, y=0, z=1",
        ),
        (["poisson", "--source", "steel: 1, solid2: 1/(z-2)"], "source of solid2 is not finite"),
    ],
)
def test_data_of_solids_are_refused_before_the_map_is_made(options, says, in_folder, capsys):
    """A cube upon a cube: the lower one has a name."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [triangle for a, b, c, d in quads for triangle in ([a, b, c], [a, c, d])]
    lines = [f"v {x} {y} {z + up}" for up in (0, 1) for x, y, z in corners]
    faces = [[f"f {a + 8 * up + 1} {b + 8 * up + 1} {c + 8 * up + 1}" for a, b, c in triangles] for up in (0, 1)]
    (in_folder / "two.obj").write_text("\n".join([*lines, "g steel", *faces[0], "g", *faces[1], ""]))
    held = ["--fix", "nz < -0.9", "--body-force", "0;0;-1"] if options[0] == "elasticity" else ["--boundary", "0"]
    assert main(["run", options[0], "two.obj", *options[1:], *held, "--out", "out"]) == 2
    assert says in capsys.readouterr().err
