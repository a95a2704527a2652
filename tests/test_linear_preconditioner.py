from dataclasses import replace

import numpy as np
import pytest
from volumes import scalar_system

from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import ConvergenceError, Elasticity, Poisson, discretize, solve_problem
from solve.discretization.face_data import face_rule
from solve.linear.preconditioner import NO_FACTORS, fast_diagonalization
from solve.study import benchmark_volume


def build(volume, dirichlet=FACE_NAMES, reaction=None):
    operator = scalar_system(volume, reaction=reaction, dirichlet=dirichlet)[0]
    return operator, fast_diagonalization(operator)


def iterations(volume):
    operator, preconditioner = build(volume)
    inner = tuple(n - 2 for n in operator.space.shape)
    b = np.random.default_rng(0).standard_normal(inner)
    result = conjugate_gradients(operator.apply_free, b, preconditioner)
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
    operator, preconditioner = build(volume)
    x = np.random.default_rng(1).standard_normal((9, 9, 9))
    assert np.allclose(preconditioner(operator.apply_free(x)), x, atol=1e-10)
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
        solve_problem(benchmark_volume(n), Poisson(exact="exp(x+z)*sin(y)")).report.iterations for n in (12, 16, 24)
    ]
    assert max(counts) <= min(counts) + 2


@pytest.mark.parametrize("dirichlet", [("u0",), ("v1", "w0", "w1"), ()])
def test_exact_on_a_box_with_a_reaction_whatever_faces_are_free(dirichlet):
    """Tensor-product Gauss rules make the mass matrix, too, the Kronecker product of the three of one dimension."""
    box = mapped(lambda x, y, z: (4.0 * x, y, 0.25 * z))
    operator, preconditioner = build(box, dirichlet, reaction=lambda x, y, z: 2.0 + 0.0 * x)
    x = np.random.default_rng(1).standard_normal(tuple(s.stop - s.start for s in operator.space.window))
    assert np.allclose(preconditioner(operator.apply_free(x)), x, atol=1e-10)


def test_without_any_constraint_the_answer_is_known_up_to_a_constant():
    operator, preconditioner = build(benchmark_volume(6), ())
    assert preconditioner.singular
    x = np.random.default_rng(1).standard_normal(operator.space.shape)
    result = conjugate_gradients(operator.apply_free, operator.apply_free(x), preconditioner)
    assert result.converged
    assert result.iterations < 40
    difference = result.x - x
    assert np.allclose(difference, difference.mean(), atol=1e-7)


def test_robin_faces_enter_the_preconditioner_exactly_on_the_cube():
    cube = mapped(lambda x, y, z: (x, y, z), n=4)
    operator, _ = build(cube, ("v0",))
    face = face_rule(cube, operator.space, "w1")
    operator = replace(operator, faces={"w1": replace(face, measure=5.0 * face.measure)})
    x = np.random.default_rng(1).standard_normal((7, 6, 7))
    assert np.allclose(fast_diagonalization(operator)(operator.apply_free(x)), x, atol=1e-10)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_the_diagonal_takes_the_place_of_what_is_not_finite(bad, monkeypatch):
    operator, usual = build(benchmark_volume(4))
    assert usual.weakness == ""
    monkeypatch.setattr("solve.linear.preconditioner._eigh", lambda k, m: (np.full(len(k), bad), np.full_like(k, bad)))
    preconditioner = fast_diagonalization(operator)
    assert preconditioner.weakness == NO_FACTORS
    unit = np.zeros((5, 5, 5))
    unit[2, 1, 3] = 1.0
    entry = operator.apply_free(unit)[2, 1, 3]
    assert np.allclose(preconditioner(unit), unit / entry)
    assert conjugate_gradients(operator.apply_free, unit, preconditioner).converged


@pytest.mark.filterwarnings("error")
def test_a_preconditioner_without_finite_numbers_is_never_a_solution(monkeypatch):
    def broken(operator, diagonal):
        found = fast_diagonalization(operator, diagonal)
        return replace(found, inverse=np.nan * found.inverse)

    monkeypatch.setattr("solve.system.fast_diagonalization", broken)
    for problem in (Poisson(source="1", boundary="0"), Elasticity(body_force=("0", "0", "-1"))):
        with pytest.raises(
            ConvergenceError, match="after 0 iterations the preconditioner does not give finite"
        ) as error:
            discretize(benchmark_volume(2), problem, threads=1).solve()
        assert error.value.solution is None
