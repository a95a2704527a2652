"""The product of any law against the matrix from dense tables of every basis function at every point."""

import numpy as np
import pytest
from volumes import mapped

from parameterize.spline.bspline import collocation
from solve import Elasticity, Form, Poisson
from solve.discretization.assembly import assemble
from solve.discretization.form_operator import FormOperator
from solve.discretization.operator import free_window
from solve.discretization.quadrature import gauss_rule
from solve.discretization.space import trial_space

UNEQUAL = mapped(
    lambda u, v, w: (u + 0.1 * np.sin(3.0 * v), v + 0.1 * u * w, 0.7 * w + 0.1 * u * u), (4, 3, 5), (1, 2, 3)
)


class Full(Form):
    """Two components that all couple: u, its gradient and x meet in flux and reaction."""

    components = 2
    symmetric = False

    def flux(self, u, grad, x):
        drift = np.stack([x[0] * u, u[::-1], 0.3 * u], axis=1)
        return np.einsum("ab,bi...->ai...", [[2.0, 0.5], [0.1, 1.0]], grad) + 0.2 * grad[:, ::-1] + drift

    def react(self, u, grad, x):
        return 3.0 * u + x[1] * u[::-1] + grad[:, 2] - 0.5 * grad[::-1, 0]


def dense(volume, form, space, rule):
    """The matrix (c n, c n) of a law, a column a basis function of a component."""
    points = np.stack(np.meshgrid(*rule.points, indexing="ij"), axis=-1).reshape(-1, 3)
    tables = [
        [collocation(space.knots[a], space.degrees[a], rule.points[a], d).toarray() for d in (0, 1)] for a in range(3)
    ]

    def basis(*derivative):
        return np.kron(np.kron(tables[0][derivative[0]], tables[1][derivative[1]]), tables[2][derivative[2]])

    jacobian, values = volume.jacobian(points), basis(0, 0, 0)
    measure = np.einsum("i,j,k->ijk", *rule.weights).ravel() * np.abs(np.linalg.det(jacobian))
    parametric = np.stack([basis(1, 0, 0), basis(0, 1, 0), basis(0, 0, 1)], axis=-1)
    gradient = np.einsum("qni,qij->qnj", parametric, np.linalg.inv(jacobian))
    c, n = form.components, space.dofs
    matrix = np.empty((c, n, c, n))
    for d in range(c):
        for j in range(n):
            u, grad = np.zeros((c, len(points))), np.zeros((c, 3, len(points)))
            u[d], grad[d] = values[:, j], gradient[:, j].T
            flux, react = form.flux(u, grad, volume(points).T), form.react(u, grad, volume(points).T) + 0.0 * u
            matrix[:, :, d, j] = np.einsum("q,aiq,qni->an", measure, flux, gradient, optimize=True)
            matrix[:, :, d, j] += (react * measure) @ values
    return matrix.reshape(c * n, c * n)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(
    "form", [Full(), Elasticity(exact=("x", "y", "z"), young=3.0), Poisson(kappa="1+x*x", reaction="2+y")],
    ids=["two components", "elasticity", "poisson as any law"],
)  # fmt: skip
def test_product_equals_the_matrix_with_unequal_degrees(form, threads):
    space = trial_space(UNEQUAL, refine=1)
    rule = gauss_rule(space)
    operator = assemble(UNEQUAL, space, form, None, rule, is_scalar=False, threads=threads).operator
    assert isinstance(operator, FormOperator)
    matrix = dense(UNEQUAL, form, space, rule)
    x = np.random.default_rng(1).standard_normal((form.components, *space.shape))
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-11 * np.abs(expected).max())
    free = operator.window
    x[:, 0], x[:, -1], x[:, :, 0], x[:, :, -1], x[..., 0], x[..., -1] = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    assert np.allclose(operator.apply_free(x[:, *free]), operator.apply(x)[:, *free], atol=1e-12)
    if form.symmetric:  # without coupling of u and its gradient, which the blocks leave out
        blocks = [operator.block(c).diagonal().ravel() for c in range(form.components)]
        assert np.allclose(np.concatenate(blocks), np.diag(matrix), rtol=1e-10)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_six_factors_equal_the_matrix_with_unequal_degrees(threads):
    space = trial_space(UNEQUAL, refine=1)
    law = {"kappa": ("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z"), "reaction": "1+x*x"}
    form = Poisson(**law)
    operator = assemble(UNEQUAL, space, form, None, window=free_window(space, ()), threads=threads).operator
    x = np.random.default_rng(1).standard_normal(space.shape)
    expected = (dense(UNEQUAL, form, space, operator.rule) @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-11 * np.abs(expected).max())
