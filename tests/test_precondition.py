import numpy as np
import pytest

from parameterize.bspline import greville, open_uniform_knots
from parameterize.volume import BSplineVolume
from solve import Poisson, solve_poisson
from solve.linear import conjugate_gradients
from solve.operators import assemble
from solve.precondition import fast_diagonalization
from solve.quadrature import gauss_rule
from solve.space import trial_space
from solve.study import benchmark_volume


def build(volume):
    space = trial_space(volume)
    stiffness = assemble(volume, space, lambda x, y, z: 0.0 * x).stiffness
    return stiffness, fast_diagonalization(stiffness, gauss_rule(space))


def iterations(volume):
    stiffness, preconditioner = build(volume)
    inner = tuple(n - 2 for n in stiffness.space.shape)
    b = np.random.default_rng(0).standard_normal(inner)
    result = conjugate_gradients(stiffness.apply_inside, b, preconditioner)
    assert result.converged
    return result.iterations


def mapped(function, n=8):
    points = greville(open_uniform_knots(n + 3, 3), 3)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    return BSplineVolume.uniform(np.stack(function(*np.moveaxis(grid, -1, 0)), axis=-1), 3)


@pytest.mark.parametrize("sizes", [(1.0, 1.0, 1.0), (4.0, 1.0, 0.25), (1e-3, 1e-3, 1e-3)])
def test_exact_on_boxes_of_any_proportion(sizes):
    """The Gauss rule is exact for the stiffness but not for the mass, in operator and preconditioner alike."""
    volume = mapped(lambda x, y, z: (sizes[0] * x, sizes[1] * y, sizes[2] * z))
    stiffness, preconditioner = build(volume)
    x = np.random.default_rng(1).standard_normal((9, 9, 9))
    assert np.allclose(preconditioner(stiffness.apply_inside(x)), x, atol=1e-10)
    assert iterations(volume) <= 2


def test_symmetric_positive_on_a_curved_map():
    _, preconditioner = build(benchmark_volume(6))
    a, b = np.random.default_rng(2).standard_normal((2, 7, 7, 7))
    assert np.vdot(a, preconditioner(b)) == pytest.approx(np.vdot(b, preconditioner(a)), rel=1e-10)
    assert np.vdot(a, preconditioner(a)) > 0.0


def test_quarter_annulus_and_taper_take_few_iterations():
    """Without coefficients per direction and scaling the annulus takes 29, the taper 42 (n = 16)."""
    annulus = mapped(lambda r, t, z: ((1 + r) * np.cos(np.pi * t / 2), (1 + r) * np.sin(np.pi * t / 2), z))
    taper = mapped(lambda x, y, z: ((x - 0.5) * (1 - 0.8 * z), (y - 0.5) * (1 - 0.8 * z), z))
    assert iterations(annulus) <= 14
    assert iterations(taper) <= 33


def test_iterations_hardly_grow_with_the_mesh_for_smooth_data():
    """19, 20, 20, 20 at n = 16, 27, 40, 64; random data feel the whole spectrum: 20, 23, 25 at 8, 16, 24."""
    counts = [
        solve_poisson(benchmark_volume(n), Poisson(exact="exp(x+z)*sin(y)")).report.iterations for n in (12, 16, 24)
    ]
    assert max(counts) <= min(counts) + 2
