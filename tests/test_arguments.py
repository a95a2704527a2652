"""What Python is told and cannot use is named at once: the argument, the value, and what may stand there."""

import pytest

import iga_nn
from iga_nn.errors import InputError
from solve.study import benchmark_volume


def raises(kind, words, work):
    with pytest.raises(kind) as caught:
        work()
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_an_option_that_a_solve_does_not_have_is_named():
    problem = iga_nn.Poisson(exact="x")
    work = lambda: iga_nn.solve(benchmark_volume(2), problem, initial="x")  # noqa: E731
    raises(TypeError, "initial: is no option of a solve; the options are tolerance, max_iterations", work)


@pytest.mark.parametrize("work", [lambda: iga_nn.load_volume(""), lambda: iga_nn.export("", "vtk")])
def test_an_empty_name_is_no_folder(work, in_folder):
    raises(InputError, "no volume is named", work)


@pytest.mark.parametrize("name", [["bean"], {}, None, 3])
def test_names_of_another_kind_are_unknown_names(name):
    raises(ValueError, f"no sample {name!r}: choose one of bean", lambda: iga_nn.sample(name))
    raises(ValueError, f"unknown preset {name!r}: choose one of fast", lambda: iga_nn.preset(name))
    raises(InputError, f"problem: must be a string, got {name!r}", lambda: iga_nn.run(name, "cube"))


@pytest.mark.parametrize("levels", ["x", 1.5, -1, None])
def test_levels_are_whole_numbers(levels):
    raises(ValueError, f"levels must be a whole number, at least 0, got {levels!r}", lambda: refined(levels))
    assert refined(1).shape == (7, 7, 7)


def refined(levels):
    return benchmark_volume(2).refined(levels)


@pytest.mark.parametrize(
    "tolerance, most, words",
    [
        (1e-3, "x", "max_control_points must be a whole number, got 'x'"),
        (1e-3, 29, "max_control_points must lie between 30, the number of the first map, and 100, got 29"),
        (1e-3, 101, "max_control_points must lie between 30, the number of the first map, and 100, got 101"),
        ("x", 40, "tolerance must be positive and finite, got 'x'"),
        (0.0, 40, "tolerance must be positive and finite, got 0.0"),
    ],
)
def test_a_refinement_has_limits(tolerance, most, words):
    config = iga_nn.preset("fast")
    raises(ValueError, words, lambda: config.refined(tolerance, most))
    assert config.refined(1e-3, 100).refinement.max_control_points == 100


@pytest.mark.parametrize(
    "count, words",
    [
        (1, "needs at least 4 control points, got 1"),
        (3, "needs at least 4 control points, got 3"),
        (101, "at most 100 control points per direction can be run, got 101"),
        (8.5, "must be a whole number, got 8.5"),
    ],
)
def test_control_points_have_limits(count, words):
    config = iga_nn.preset("fast")
    raises(ValueError, words, lambda: config.with_control_points(count))
    assert config.with_control_points(4).spline.control_points == 4
    assert config.with_control_points(100).spline.control_points == 100


def test_a_seed_is_not_negative():
    raises(ValueError, "seed must not be negative, got -1", lambda: iga_nn.parameterize(iga_nn.sample("cube"), seed=-1))
    raises(InputError, "seed", lambda: iga_nn.run("poisson", "cube", seed=-1))


def test_a_progress_that_cannot_be_called_is_refused_before_anything_begins(in_folder, monkeypatch):
    monkeypatch.setattr("parameterize.run.attempts", lambda *_: pytest.fail("training must not start"))
    cube = iga_nn.sample("cube")
    raises(TypeError, "progress must be a function of a Progress, or None, got 3", lambda: train(cube))
    raises(InputError, "progress: must be a function or None, got 3", lambda: iga_nn.run("poisson", "cube", progress=3))
    raises(InputError, "progress: must be a function or None", lambda: iga_nn.run_batch(["cube"], "out", progress=3))
    assert list(in_folder.iterdir()) == []


def train(surface):
    return iga_nn.parameterize(surface, progress=3)
