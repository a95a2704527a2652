"""Names of earlier versions: they go on working, with a warning that says the new one."""

import importlib
import pickle

import pytest

import iga_nn
from parameterize.old_names import RENAMED
from solve import benchmark_volume


@pytest.mark.parametrize("old", [name for name in RENAMED if name.count(".") == 1 and not name.startswith("solve")])
def test_an_old_name_is_the_new_one_with_a_warning(old):
    package, name = old.split(".")
    module = importlib.import_module(package)
    with pytest.warns(DeprecationWarning, match=f"{old} is now called {package}.{RENAMED[old]}"):
        assert getattr(module, name) is getattr(module, RENAMED[old])


@pytest.mark.parametrize("name", ["Nothing", "nothing"])
def test_a_name_that_never_was_is_no_attribute(name):
    with pytest.raises(AttributeError, match=f"module 'iga_nn' has no attribute '{name}'"):
        getattr(iga_nn, name)


def test_a_body_of_an_earlier_pickle_is_found():
    body = iga_nn.Body((benchmark_volume(1),))
    earlier = pickle.dumps(body, protocol=0).replace(b"spline.body\nBody", b"spline.multipatch\nMultiPatch")
    assert b"multipatch" in earlier and type(pickle.loads(earlier)) is iga_nn.Body


STEPS = {"start": "0", "dt": 1.0, "steps": 1}
FUNCTIONS = [
    (iga_nn.convergence, {}),
    (iga_nn.march, STEPS),
    (iga_nn.newton, {}),
    (iga_nn.solve, {}),
    (iga_nn.discretize, {}),
]


@pytest.mark.parametrize(("function", "more"), FUNCTIONS)
def test_a_body_by_its_earlier_keyword_is_taken_with_a_warning(function, more):
    with pytest.warns(DeprecationWarning, match=rf"{function.__name__}\(volume=...\)"), pytest.raises(TypeError):
        function(volume=None, problem=iga_nn.Poisson(source="1"), **more)


@pytest.mark.parametrize(("function", "more"), FUNCTIONS)
def test_a_body_by_both_keywords_is_refused(function, more):
    volume, problem = benchmark_volume(1), iga_nn.Poisson(source="1", boundary="0")
    with pytest.raises(TypeError, match=f"{function.__name__}: volume is the earlier name of body"):
        function(volume, problem, volume=volume, **more)
    with pytest.raises(TypeError, match="give one of them"):
        function(body=volume, problem=problem, volume=volume, **more)
