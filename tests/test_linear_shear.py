from itertools import combinations

import numpy as np
import pytest
from volumes import mapped, scalar_system

from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.spline.volume import FACE_NAMES
from solve import Elasticity, discretize
from solve.linear.preconditioner import NO_FACTOR, fast_diagonalization
from solve.linear.shear import OFFSETS, SHIFTS, _factorize, _stencils, helps, incomplete_cholesky
from solve.patch_system import operators_of
from solve.study import benchmark_volume


def sheared(slope, shape=(9, 9, 9), degree=3):
    """A cube whose x runs along with y, and y with z."""
    return mapped(lambda x, y, z: (x + slope * y, y + slope * z, z), shape, (degree,) * 3)


def free_shape(operator):
    sizes = zip(operator.space.window, operator.space.shape, strict=True)
    return tuple(len(range(*free.indices(n))) for free, n in sizes)


def matrix_of(operator):
    shape = free_shape(operator)
    units = np.eye(int(np.prod(shape))).reshape(-1, *shape)
    return np.stack([operator.apply_free(unit).ravel() for unit in units])


def test_it_acts_on_sheared_maps_alone():
    assert not helps(scalar_system(sheared(0.5))[0])
    assert helps(scalar_system(sheared(3.0))[0])
    assert not helps(scalar_system(sheared(3.0, degree=4))[0])
    assert fast_diagonalization(scalar_system(benchmark_volume(6))[0]).local is None


@pytest.mark.parametrize("faces", [FACE_NAMES, ("u0", "v1")])
def test_for_degree_one_the_elements_are_those_of_the_operator(faces):
    operator = scalar_system(sheared(0.7, (5, 4, 6), 1), dirichlet=faces)[0]
    stencils = _stencils(operator)
    shape = stencils.shape[:3]
    dense = np.zeros((*shape, *shape))
    for node in np.ndindex(shape):
        for offset, value in zip(OFFSETS, stencils[node], strict=True):
            if value != 0.0:
                dense[node][tuple(node + offset)] = value
    lower = dense.reshape(np.prod(shape), -1)
    assert np.allclose(lower, np.tril(matrix_of(operator)), atol=1e-13)


def test_the_factors_are_exact_where_nothing_fills_in():
    """One free node across: the matrix is tridiagonal."""
    operator = scalar_system(sheared(0.7, (9, 3, 3), 1))[0]
    x = np.random.default_rng(0).standard_normal(free_shape(operator))
    assert np.allclose(incomplete_cholesky(operator)(operator.apply_free(x)), x, atol=1e-12)


@pytest.mark.parametrize(("degree", "most"), [(2, 35), (3, 46)])
def test_fewer_iterations_on_a_sheared_map(degree, most):
    """Fast diagonalization alone takes 55 and 60."""
    operator = scalar_system(sheared(3.0, (14, 14, 14), degree))[0]
    b = np.random.default_rng(1).standard_normal(free_shape(operator))
    result = conjugate_gradients(operator.apply_free, b, fast_diagonalization(operator))
    assert result.converged and result.iterations <= most


def test_symmetric_and_positive():
    preconditioner = fast_diagonalization(scalar_system(sheared(3.0), dirichlet=("u0", "w1"))[0])
    assert preconditioner.local is not None
    a, b = np.random.default_rng(2).standard_normal((2, *preconditioner.inverse.shape))
    assert np.vdot(a, preconditioner(b)) == pytest.approx(np.vdot(b, preconditioner(a)), rel=1e-10)
    assert np.vdot(a, preconditioner(a)) > 0.0


def kershaw(shift):
    """Kershaw's matrix, positive definite, without an incomplete factor: its pivots are 3, 5/3, 3/5 and -5."""
    lower, steps, places = np.zeros((4, 14)), np.zeros(14, dtype=int), np.full((13, 13), -1)
    lower[:, 13], steps[:2] = 3.0, (-3, -1)
    lower[3, 0], lower[1:, 1] = 2.0, -2.0
    return _factorize(lower, 0, steps, places, shift), lower


def test_a_pivot_below_zero_is_noticed_and_a_shift_lifts_it():
    succeeded, factor = kershaw(0.0)
    assert not succeeded
    assert np.allclose(factor[:3, 13], [3.0**-0.5, 0.6**0.5, (5 / 3) ** 0.5])
    succeeded, factor = kershaw(1.0)
    assert succeeded and np.isfinite(factor).all() and (factor[:, 13] > 0.0).all()
    assert kershaw(SHIFTS[-1])[0]


@pytest.mark.parametrize("count", range(1, 6))
def test_the_factor_is_finite_whatever_faces_are_free(count):
    """Without a shift most factors of this map have no positive pivots, and some get numbers that are not finite."""
    body = mapped(lambda u, v, w: (u + 3.0 * v * v + 3.0 * w, v + 4.0 * w * w, 0.2 * w), (7, 7, 7))
    for free in combinations(FACE_NAMES, count):
        load = Elasticity(body_force=("0", "0", "-1"), traction=dict.fromkeys(free, ("0", "0", "0")))
        (operators,) = operators_of(discretize(body, load, threads=1).matrix, 3)
        for block in map(fast_diagonalization, operators):
            assert block.local is not None and not block.weakness
            residual = np.random.default_rng(3).standard_normal(block.scaling.shape)
            found = block(residual)
            assert np.isfinite(found).all() and np.vdot(residual, found) > 0.0


def test_a_factor_that_gives_no_finite_numbers_is_left_out(monkeypatch):
    operator = scalar_system(sheared(3.0))[0]
    broken = incomplete_cholesky(operator)
    broken.factor[:] = np.nan
    for found in (broken, None):
        monkeypatch.setattr("solve.linear.preconditioner.incomplete_cholesky", lambda _, found=found: found)
        preconditioner = fast_diagonalization(operator)
        assert preconditioner.local is None and preconditioner.weakness == NO_FACTOR
        b = np.random.default_rng(1).standard_normal(free_shape(operator))
        assert conjugate_gradients(operator.apply_free, b, preconditioner).converged
