from __future__ import annotations

from dataclasses import fields, replace

import pytest

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.options import (
    PROBLEMS,
    ElasticityOptions,
    FiniteOptions,
    MapOptions,
    PlasticOptions,
    PoissonOptions,
    StudyOptions,
    WorkerOptions,
)
from solve.study import benchmark_volume

NOT_TOLD = {"unit", "stress_unit", "solve_anyway"}  # but to the reader, and to the run
SPACE = {"refine": (2,), "degree": 2, "quadrature": "gauss", "ask": ("energy",), "accuracy": "1%"}
SCALAR = dict.fromkeys(("exact", "source", "boundary", "kappa", "reaction"), "1")
VECTOR = dict.fromkeys(("exact", "body_force", "displacement"), "1;1;1")
REFUSED = {"exact": "1;1;1", "ask": ("energy",), "accuracy": "1%"}
REFUSED |= {"cyclic": ("u0, u1 about z",), "rigid": ("x < 1",)}
REFUSED |= dict.fromkeys(("shear", "c10", "c01", "c20", "c30"), 7.0)
BODY = (
    {"fix": ("x < 1",), "roller": ("x < 1",), "body_force": "1;1;1"}
    | {"symmetry": ("x < 1",), "load": ("x < 1=1;1;1",), "pressure": ("x < 1=1",), "spring": ("x < 1=1",)}
    | dict.fromkeys(("total_spring", "foundation"), ("x < 1=1",))
    | dict.fromkeys(("total_force", "moment", "bearing"), ("x < 1=1;1;1",))
    | dict.fromkeys(("turn", "hydrostatic", "remote_force"), ("x < 1=1;1;1 at (0, 0, 1)",))
    | {"density": 2.0, "gravity": "0;1;0", "acceleration": "1;0;0", "spin": "0;0;1 at (0, 0, 0)"}
)
STEPS = BODY | {"refine": (2,), "degree": 2, "quadrature": "gauss", "steps": 3}
LOADED = {"body_force": "2;2;2", "density": 1.0, "gravity": "0;0;1", "fix": ("y < 1",)}
ORTHOTROPIC = {"young": "3;2;2", "poisson_ratio": "0.2;0.2;0.2", "shear_modulus": "1;1;0.83333333"}
ORTHOTROPIC |= {"alpha": 1e-5, "temperature_change": "20"}
OTHERS = {
    PlasticOptions(**LOADED): STEPS
    | {"young": 2.0, "poisson_ratio": 0.2}
    | {"yield_strength": 3.0, "hardening": 1.0, "material": "steel"},
    FiniteOptions(**LOADED): STEPS | {"shear": 2.0, "bulk": 9.0},
    FiniteOptions(**LOADED, law="mooney-rivlin", c10=1.0): STEPS | {"c10": 2.0, "c01": 1.0, "bulk": 9.0, "law": "yeoh"},
    FiniteOptions(**LOADED, law="yeoh", c10=1.0): STEPS
    | {"c10": 2.0, "c20": 1.0, "c30": 1.0, "bulk": 9.0, "law": "mooney-rivlin"},
    PoissonOptions(source="2"): SPACE
    | SCALAR
    | {"neumann": ("u1=1",), "robin": ("u1=1:1",), "value": ("x < 1=1",), "flux": ("x < 1=1",)}
    | {"exchange": ("x < 1=1:1",), "cyclic": ("u0, u1 about z",)},
    ElasticityOptions(body_force="2;2;2", density=1.0, gravity="0;0;1", **ORTHOTROPIC): SPACE
    | VECTOR
    | {"traction": ("u1=1;1;1",), "young": "4;2;2", "poisson_ratio": "0.1;0.2;0.2", "formulation": "mixed"}
    | {"shear_modulus": "1;2;1", "first_axis": "0;1;0", "second_axis": "0;1;1", "yield_strength": 3.0}
    | {"alpha": 2e-5, "temperature_change": "30", "cyclic": ("u0, u1 about z",), "rigid": ("x < 1",)}
    | BODY,
}


def told(options):
    """What a solve is told of the options; `run` and `solve` ask for the same."""
    return options.problem(), options.solve_options(), options.refine, options.wanted


@pytest.mark.parametrize(("options", "others"), OTHERS.items(), ids=lambda given: getattr(given, "section", ""))
def test_every_option_of_a_problem_is_told_to_the_solver(options, others):
    for field in fields(options):
        if field.name in REFUSED and field.name not in others:
            with pytest.raises(InputError, match=f"--{field.name}: "):
                told(replace(options, **{field.name: REFUSED[field.name]}))
        elif field.name not in NOT_TOLD | ({"law", "material"} - set(others)):
            assert told(replace(options, **{field.name: others[field.name]})) != told(options), field.name


def test_units_change_nothing_that_is_solved():
    options = ElasticityOptions(body_force="1;1;1")
    assert told(replace(options, unit="mm", stress_unit="MPa")) == told(options)


@pytest.mark.parametrize("unit", ["", " ", "m\nm", "x" * 21])
def test_a_unit_is_a_short_text(unit):
    with pytest.raises(InputError, match="--unit .*: give a short text such as mm, at most 20 letters"):
        PoissonOptions(unit=unit)
    with pytest.raises(InputError, match="--stress-unit"):
        ElasticityOptions(stress_unit=unit)


def test_shared_options_leave_the_order_of_the_own_ones():
    assert MapOptions("paper", 3).seed == 3 and PoissonOptions("x", "1").source == "1"


def test_every_problem_is_tested_here():
    assert {type(options) for options in OTHERS} == set(PROBLEMS.values())


@pytest.mark.parametrize("group", ["run", "solve", "study", "batch", "app"])
@pytest.mark.parametrize("problem", PROBLEMS)
def test_every_problem_is_a_command_of_each_group(group, problem, capsys):
    assert main([group, problem, "--help"]) == 0
    said, kind = capsys.readouterr().out, PROBLEMS[problem]
    for name in (*kind.on_regions(), *kind.on_faces):
        assert f"--{name.replace('_', '-')} " in said


def test_a_batch_and_a_study_of_a_body_ask_for_its_data(in_folder, capsys):
    assert main(["batch", "elasticity", "cube", "--out", "out"]) == 2
    assert "nothing acts on the body" in capsys.readouterr().err
    benchmark_volume(2).save("map.npz")
    assert main(["study", "map.npz", "--source", "1"]) == 2
    assert "no solution to compare with" in capsys.readouterr().err


def test_a_spring_has_a_value_outside_on_the_command_line_too():
    options = ElasticityOptions(spring=("u0=7", "v0=x:0;0;1"), load=("u1=0;0;1",))
    assert [one.text for one in options.problem().conditions] == ["7", "x, outside 0;0;1", "0;0;1"]


def test_auto_takes_its_limits_to_the_map():
    config = MapOptions(control_points="auto", tolerance=1e-3, max_control_points=40).config()
    assert (config.refinement.tolerance, config.refinement.max_control_points) == (1e-3, 40)
    assert config.spline == MapOptions().config().spline and MapOptions().config().refinement is None
    assert MapOptions(control_points="auto").most_control_points == 60 and MapOptions().most_control_points == 30


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"control_points": "auto", "tolerance": 0.0}, "tolerance must be positive and finite, got 0.0"),
        (
            {"control_points": "auto", "max_control_points": 29},
            "must lie between 30, the number of the first map, and 100, got 29",
        ),
        ({"control_points": "auto", "max_control_points": 101}, "the first map, and 100, got 101"),
        ({"control_points": 3}, "degree 3 needs at least 4 control points, got 3"),
        ({"tolerance": 1e-3}, "tolerance: requires --control-points auto"),
        ({"control_points": "many"}, "control points: must be a whole number or 'auto', got 'many'"),
        ({"seed": True}, "seed: must be a whole number, got True"),
        ({"steps_factor": None}, "steps factor: must be a number, got None"),
        ({"component": "x"}, "component: must be a whole number or 'largest' or None, got 'x'"),
        ({"max_faces": "x"}, "max faces: must be a whole number, got 'x'"),
        ({"corners": [1, 2]}, "corners: must be a path or None, got .1, 2."),
        ({"max_control_points": 40}, "max control points: requires --control-points auto"),
    ],
)
def test_limits_that_cannot_be_run_are_refused(given, says):
    with pytest.raises(InputError, match=says):
        MapOptions(**given).config()


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (
            lambda: PoissonOptions(neumann={"u1": "0"}),
            "neumann: must be a tuple or a list, each entry a string, got {'u1': '0'}",
        ),
        (lambda: PoissonOptions(quadrature="foo"), "quadrature: must be 'spline' or 'gauss' or 'gauss.1', got 'foo'"),
        (lambda: PoissonOptions(refine=1), "refine: must be a tuple or a list, each entry a whole number, got 1"),
        (lambda: ElasticityOptions(young=None), "young: must be a number or a string, got None"),
        (lambda: MapOptions(resume="yes"), "resume: must be True or False, got 'yes'"),
        (lambda: WorkerOptions(workers=1.5), "workers: must be a whole number, got 1.5"),
    ],
)
def test_a_value_of_another_kind_is_refused_where_the_options_are_made(made, says):
    with pytest.raises(InputError, match=says):
        made()


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (StudyOptions(refine=("3..1",)).levels, "refine '3..1': the range ends before it begins; write 1..3"),
        (PoissonOptions(refine=()).problem, "refine is empty: give one or more levels"),
        (ElasticityOptions("x;y;z", young=1e300).problem, "young must be a positive number from 1e-100 to 1e.100"),
    ],
)
def test_problems_that_cannot_be_run_are_refused(asked, says):
    with pytest.raises(InputError, match=says):
        asked()


def test_a_plane_of_a_solid_model_has_a_sign_of_its_own():
    body = iga_nn.ElasticityOptions(fix=("plane z = 0",), load=("plane x=60 or plane x=-6=0;0;-1",))
    fix, load = body.conditions(3)
    assert str(fix.region) == "plane z = 0"
    assert str(load.region) == "plane x=60 or plane x=-6" and load.text == "0;0;-1"


def test_a_metal_of_the_library_yields_at_its_strength():
    options = PlasticOptions(material="steel", fix=("u0",), load=("u1=1;0;0",))
    metal, said = options.problem(), options.values()
    assert (said["young"], said["unit"], said["materials"][0]["yield_strength"]) == (None, "mm", 235.0)
    assert options.law_of(said)[1][0] == "material steel"
    assert (metal.young, metal.poisson_ratio, metal.yield_strength) == (210000.0, 0.3, 235.0)
    with pytest.raises(InputError, match="--material and --young: give one of them"):
        PlasticOptions(material="steel", young=2.0, fix=("u0",), load=("u1=1;0;0",)).problem()


@pytest.mark.parametrize("kind", [iga_nn.PlasticOptions, iga_nn.FiniteOptions])
def test_load_steps_refuse_coupled_regions_before_a_map_is_made(kind):
    with pytest.raises(InputError, match="--cyclic: regions are coupled in linear problems only; leave it out"):
        kind(fix=("u0",), load=("u1=0;0;1",), cyclic=("v0, v1 about z",))
    with pytest.raises(InputError, match="--rigid: motions of rigid regions are found in linear problems only"):
        kind(fix=("u0",), load=("u1=0;0;1",), rigid=("u1",))


def test_rigid_regions_and_an_accuracy_are_refused_together():
    with pytest.raises(InputError, match="--rigid: its meshes are not refined by --accuracy; leave one of them out"):
        iga_nn.ElasticityOptions(fix=("u0",), rigid=("u1",), accuracy=0.1)
