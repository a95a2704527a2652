import json
from dataclasses import asdict, replace

import pytest

from parameterize.config import PRESETS, preset


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_presets_follow_the_papers_stages(name):
    config = preset(name)
    assert config.name == name
    assert [s.name for s in config.stages] == ["S(2)", "S(1)", "cube", "corners", "edges"]
    assert [s.weights.cor > 0.0 for s in config.stages] == [False, False, False, True, True]
    assert [s.weights.edge > 0.0 for s in config.stages] == [False, False, False, False, True]
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
    with pytest.raises(ValueError, match="between 12 and 100, got 11"):
        config.refined(1e-3, 11)


def test_with_control_points():
    config = preset("fast").with_control_points(12)
    assert config.spline.control_points == 12 and config.stages == preset("fast").stages
    for other, says in ((3, "needs at least 4 control points, got 3"), (8.5, "must be a whole number, got 8.5")):
        with pytest.raises(ValueError, match=says):
            config.with_control_points(other)
