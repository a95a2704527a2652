"""Jets in NumPy's hands: arithmetic, functions, and arrays of them."""

import numpy as np
import pytest
from formulas import hessian

from solve.forms.jets import Jet, coordinates
from solve.forms.parser import Expression

POINTS = np.random.default_rng(0).uniform(0.3, 1.2, (3, 20))


def test_jets_mix_with_numbers_and_arrays():
    """(2 / (3 - x))^2 - x^x + 2 - x at x = 1: first derivatives 8 / (3 - x)^3 = 1, log x + 1 = 1 and -1."""
    x = Jet(np.ones(1), (np.ones(1), 0.0, 0.0))
    jet = (np.float64(2.0) / (3 - x)) ** 2 - x**x + np.array([0.0, 1.0]) @ np.array([x, 2 - x])
    assert jet.value == pytest.approx(1.0) and jet.gradient[0] == pytest.approx(-1.0)
    assert jet.hessian[0] == pytest.approx(24.0 / 16.0 - 2.0)


@pytest.mark.parametrize(
    ("function", "text"),
    [
        (lambda x, y, z: np.exp(x + z) * np.sin(y), "exp(x+z)*sin(y)"),
        (lambda x, y, z: np.cos(x * y) / (1 + z**2) - np.tan(z / 3), "cos(x*y)/(1+z**2)-tan(z/3)"),
        (lambda x, y, z: np.log(x + y) * np.sqrt(z) + abs(x - 5), "log(x+y)*sqrt(z)+abs(x-5)"),
        (lambda x, y, z: 2 ** np.tanh(x) - (1 - y) ** -2 + np.float64(3.0) / z, "2**tanh(x)-(1-y)**-2+3/z"),
    ],
)
def test_functions_of_numpy_have_the_derivatives_of_the_formula(function, text):
    x = np.empty(3, dtype=object)
    x[:] = coordinates(POINTS, (0.0,) * 6)
    found, wanted = function(*x), hessian(Expression(text), *POINTS)
    for ours, theirs in zip((found.value, found.gradient, found.hessian), wanted, strict=True):
        full = np.stack([np.broadcast_to(row, (20,)) for row in (ours if isinstance(ours, tuple) else [ours])])
        assert np.allclose(full, np.reshape(theirs, full.shape), rtol=1e-12)


def test_arrays_of_jets_are_arrays():
    """The divergence of (x y, y z, z x) is x + y + z, also through einsum, stack and transposition."""
    x = np.empty(3, dtype=object)
    x[:] = coordinates(POINTS)
    field = np.stack([np.stack([x[0] * x[1], x[1] * x[2], x[2] * x[0]])])
    turned = np.einsum("ij,cj->ci", np.eye(3), field).swapaxes(0, 1)
    assert turned.shape == (3, 1)
    assert np.allclose(sum(turned[i, 0].gradient[i] for i in range(3)), POINTS[[1, 2, 0]].sum(axis=0))


def test_a_power_may_be_one_of_numpys_integers():
    """Also of a negative base, which has no logarithm: the derivative of x^2 at -3 is -6."""
    jet = Jet(np.full(1, -3.0), (np.ones(1), 0.0, 0.0)) ** np.int64(2)
    assert jet.value == 9.0 and jet.gradient[0] == -6.0


def test_what_is_no_number_is_refused():
    with pytest.raises(TypeError):
        Jet(np.ones(2)) + "1"
