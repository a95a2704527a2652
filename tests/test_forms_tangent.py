"""The derivative of a law by jets, beside differences of the law."""

import numpy as np
import pytest
from example_files import load

import iga_nn
from solve.forms.form import reaction
from solve.forms.tangent import derivative


class Pair(iga_nn.Form):
    """Two components that feed each other, with a coefficient of x."""

    components = 2
    linear = symmetric = False

    def flux(self, u, grad, x):
        return np.stack([(1 + u[1] ** 2) * grad[0] * x[0], np.exp(u[0]) * grad[1]])

    def react(self, u, grad, x):
        return np.stack([u[0] * u[1] + grad[0, 1], np.sin(u[0]) * grad[1, 2]])


@pytest.mark.parametrize("form", [Pair(), load("large_strain").NeoHookean(1.5, 1.0)], ids=["pair", "neo-hookean"])
def test_the_derivative_is_the_limit_of_differences(form):
    rng, c, step = np.random.default_rng(0), form.components, 1e-6
    u, grad, x = rng.uniform(-0.2, 0.2, (c, 7)), rng.uniform(-0.2, 0.2, (c, 3, 7)), rng.uniform(1.0, 2.0, (3, 7))

    def law(values):
        return np.concatenate(
            [reaction(form, values[:, 0], values[:, 1:], x)[:, None], form.flux(values[:, 0], values[:, 1:], x)], axis=1
        )

    values, found = np.concatenate([u[:, None], grad], axis=1), derivative(form, u, grad, x)
    assert found.shape == (c, 4, c, 4, 7)
    for d in range(c):
        for k in range(4):
            by = np.zeros_like(values)
            by[d, k] = step
            assert np.allclose(found[:, :, d, k], (law(values + by) - law(values - by)) / (2.0 * step), atol=1e-7)
