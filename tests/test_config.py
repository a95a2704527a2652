import ast
import json
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path

import pytest

import iga_nn
import parameterize
from parameterize.config import PRESETS, SplineConfig, preset
from parameterize.training.losses import STAGES


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_presets_follow_the_papers_stages(name):
    config = preset(name)
    assert config.name == name
    names = [s.name for s in config.holding_edges().stages]
    assert names == ["S(2)", "S(1)", "cube", "corners", "edges"]
    assert names[: len(config.stages)] == [s.name for s in config.stages]
    weights = [STAGES[name].weights for name in names]
    assert [row.cor > 0.0 for row in weights] == [False, False, False, True, True]
    assert [row.edge > 0.0 for row in weights] == [False, False, False, False, True]
    assert json.loads(json.dumps(asdict(config)))["spline"]["control_points"] == 30


def test_unknown_preset_names_the_choices():
    with pytest.raises(ValueError, match="'quick'.*fast, grown, paper"):
        preset("quick")


def test_scaled_changes_the_number_of_steps_alone():
    config = preset("fast")
    half = config.scaled(0.5)
    assert [s.steps for s in half.stages] == [round(0.5 * s.steps) for s in config.stages]
    assert half.spline.steps == round(0.5 * config.spline.steps)
    assert half.train == replace(config.train, easy_loss=None)  # every shape looks hard then
    assert half.steps_factor == 0.5 and half.scaled(0.5).steps_factor == 0.25
    shortest = config.scaled(1e-9)
    assert {s.steps for s in shortest.stages} == {1} and shortest.spline.steps == 1
    assert config.scaled(1.0) == config
    assert config.scaled(100.0).stages[0].steps == 100 * config.stages[0].steps


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf"), 100.1])
def test_scaled_refuses_factors_out_of_range(factor):
    with pytest.raises(ValueError, match="factor"):
        preset("fast").scaled(factor)


def test_refined():
    config = preset("fast").with_control_points(12).refined(1e-3, 20)
    assert config.spline.control_points == 12
    assert (config.refinement.tolerance, config.refinement.max_control_points) == (1e-3, 20)
    assert preset("fast").refinement is None
    for tolerance in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="tolerance must be positive and finite"):
            config.refined(tolerance, 20)
    with pytest.raises(ValueError, match="between 12, the number of the first map, and 100, got 11"):
        config.refined(1e-3, 11)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"control_points": 3}, "degree 3 needs at least 4 control points, got 3"),
        ({"control_points": (4, 7, 11)}, r"number of control points must be a whole number, got \(4, 7, 11\)"),
        ({"degree": 0}, "degree must be at least 1, got 0"),
        ({"degree": 2.5}, "degree must be a whole number, got 2.5"),
    ],
)
def test_a_spline_that_does_not_exist_is_refused_at_once(numbers, message):
    with pytest.raises(ValueError, match=message):
        SplineConfig(**numbers)


def test_with_control_points():
    config = preset("fast").with_control_points(12)
    assert config.spline.control_points == 12 and config.stages == preset("fast").stages


def numbers_in(value):
    """How many numbers a table of options holds, those in its parts counted; a switch is none."""
    if isinstance(value, dict):
        return sum(map(numbers_in, value.values()))
    if isinstance(value, list | tuple):
        return sum(map(numbers_in, value))
    return int(isinstance(value, int | float) and not isinstance(value, bool))


def test_few_numbers_are_left_to_the_user():
    options = asdict(preset("fast"))
    assert sum(numbers_in(options[part]) for part in ("network", "train", "stages")) <= 25
    assert numbers_in(options) <= 60


def option_names(value):
    """The names of all fields of a dataclass and of the dataclasses in it."""
    for field in fields(value):
        yield field.name
        part = getattr(value, field.name)
        for inner in part if isinstance(part, tuple) else (part,):
            if is_dataclass(inner):
                yield from option_names(inner)


def test_every_option_is_read_somewhere():
    read = set()
    for package in (parameterize, iga_nn):
        for path in Path(package.__file__).parent.rglob("*.py"):
            if path.name != "config.py":
                tree = ast.parse(path.read_text(encoding="utf-8"))
                read |= {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert set(option_names(preset("fast").refined(1e-3, 40))) <= read
