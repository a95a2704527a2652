"""The matrix from few products is that of all products, and its factor solves."""

import numpy as np
import pytest

import iga_nn
from iga_nn import BSplineVolume, Elasticity, Poisson
from solve.linear.direct import factorized, price_of, sparse
from solve.linear.inverse import RoughInverse


def bent(a=0.0, b=1.5, n=5, degree=2):
    return BSplineVolume.from_function(
        lambda u, v, w: ((1 + u) * np.cos(a + (b - a) * v), (1 + u) * np.sin(a + (b - a) * v), w), (4, n, 3), degree
    )


def ring():
    """One patch that is glued to itself."""
    return iga_nn.Body.from_patches([bent(0.0, 2.0 * np.pi, 9)])


LAWS = {
    "weak": Elasticity(fix="u0 and z < 0.6", roller="w1", spring={"u1": 3.0}),
    "strong": Elasticity(displacement=("0", "0", "0"), traction={"u1": ("0", "0", "0")}),
    "robin": Poisson(source="1", neumann={"w0": "0"}, robin={"u1": ("2", "0")}),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("make", [bent, ring, lambda: iga_nn.Body.from_patches([bent(), bent(1.5, 2.5, 4)])])
def test_entries_and_factor(law, make):
    system = iga_nn.discretize(make(), law)
    matrix = sparse(system.unknowns, system.matrix, len(system.right))
    whole = system.operator @ np.eye(len(system.load))
    assert matrix.toarray() == pytest.approx(whole, abs=1e-12 * np.abs(whole).max())
    solve = factorized(matrix, system.points)
    right = np.random.default_rng(0).standard_normal((len(system.load), 2))
    assert solve is not None and whole @ solve(right) == pytest.approx(right, abs=1e-8)


def test_a_matrix_that_is_not_positive_has_no_factor():
    system = iga_nn.discretize(bent(), LAWS["strong"])
    matrix = sparse(system.unknowns, system.matrix, 3)
    assert factorized(-matrix, system.points) is None


def test_a_factor_takes_over_when_it_is_paid_for():
    """The diagonal 1, .., 100 takes conjugate gradients some iterations to a tenth, a factor none."""
    values, asked = np.arange(1.0, 101.0), []

    def factorize():
        asked.append(True)
        return lambda columns: columns / values[:, None]

    inverse = RoughInverse(lambda x: values * x, lambda x: x, factorize, 4)
    right = np.ones((100, 3))
    found = inverse(right[:, :1])
    assert not asked and not inverse.is_exact
    assert np.linalg.norm(values * found[:, 0] - 1.0) <= 0.1 * 10.0
    assert inverse(right) == pytest.approx(right / values[:, None], rel=1e-12)
    assert asked == [True] and inverse.is_exact
    with pytest.raises(ValueError, match="no modes"):
        RoughInverse(lambda x: values * x, lambda x: x, lambda: None, 0)(right)


def test_the_price_counts_products_and_the_factor():
    system = iga_nn.discretize(bent(), LAWS["strong"])
    price = price_of(system.unknowns, [patch.matrix for patch in system.patches], 3)
    assert price == pytest.approx(3 * 5**3 / 2 + len(system.load) / 20)
