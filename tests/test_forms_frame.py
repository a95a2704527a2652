"""X, Y, Z: the coordinates of a volume scaled to volume 1 about the middle of its bounding box."""

import numpy as np
import pytest
from formulas import hessian

import iga_nn
from solve import benchmark_volume, solve_problem
from solve.forms.frame import UnitFrame
from solve.forms.parser import Expression, ExpressionError
from solve.forms.poisson import DEFAULT_EXACT

BOX = iga_nn.BSplineVolume.uniform(
    np.stack(np.meshgrid([2.0, 6.0], [-1.0, 1.0], [0.0, 1.0], indexing="ij"), axis=-1), 1
)  # 4 x 2 x 1
FRAME = UnitFrame((4.0, 0.0, 0.5), 2.0)


def test_a_box_has_the_frame_that_is_computed_by_hand():
    frame = UnitFrame.of(BOX)
    assert frame.center == pytest.approx((4.0, 0.0, 0.5))
    assert frame.length == pytest.approx(2.0)
    assert frame.as_dict() == {"center": list(frame.center), "length": frame.length}
    assert frame.to_units(np.array([[0.5, 0.0, -0.25]])) == pytest.approx(np.array([[5.0, 0.0, 0.0]]))


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_the_volume_from_the_faces_is_the_integral_of_det_j(degree):
    volume = benchmark_volume(3, degree)
    u = np.polynomial.legendre.leggauss(3 * degree)
    nodes, w = (u[0] + 1.0) / 2.0, u[1] / 2.0
    breaks = np.linspace(0.0, 1.0, 4)
    points = np.concatenate([a + (b - a) * nodes for a, b in zip(breaks, breaks[1:], strict=False)])
    weights = np.tile(w / 3.0, 3)
    det = np.linalg.det(volume.grid_jacobian(points, points, points))
    assert UnitFrame.of(volume).length ** 3 == pytest.approx(np.einsum("ijk,i,j,k", det, *[weights] * 3), rel=1e-12)


def test_the_frame_follows_the_volume_far_away_and_in_other_units():
    near, far = (UnitFrame.of(v) for v in (BOX, BOX.transformed(1e3, [4e7, 0.0, 0.0])))
    assert far.length == pytest.approx(1e3 * near.length, rel=1e-9)
    assert far.center == pytest.approx((4e7 + 4e3, 0.0, 500.0))


def test_scaled_names_are_the_scaled_coordinates_with_their_derivatives():
    x, y, z = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 20))
    scaled = Expression("X**2*Y + sin(Z)*x").placed(FRAME)
    written = Expression("((x-4)/2)**2*(y/2) + sin((z-0.5)/2)*x")
    for found, expected in zip(hessian(scaled, x, y, z), hessian(written, x, y, z), strict=True):
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-13)
    assert scaled(x, y, z) == pytest.approx(written(x, y, z))
    assert scaled.variables == {"X", "Y", "Z", "x"}


def test_scaled_names_need_a_volume():
    with pytest.raises(ExpressionError, match=r"X, Y, Z .* problem\.on\(volume\)"):
        Expression("X")(np.zeros(1), np.zeros(1), np.zeros(1))


def test_a_formula_is_suggested_in_scaled_names():
    assert Expression("exp(x+z)*sin(y)*e").scaled_text == "exp(X+Z)*sin(Y)*e"
    assert Expression("exp(2)").scaled_text is None


def test_every_datum_of_a_problem_knows_the_scaled_names():
    """The same problem in x, y, z and in X, Y, Z of a box of length 2 has the same coefficients."""
    scaled = iga_nn.Poisson(
        exact="X*Y+Z", kappa="2+X", reaction="1+Y*Y", neumann={"u1": None}, robin={"w0": ("2+X*X", None)}
    )
    written = iga_nn.Poisson(
        exact="(x-4)/2*y/2+(z-0.5)/2",
        kappa="2+(x-4)/2",
        reaction="1+y/2*y/2",
        neumann={"u1": None},
        robin={"w0": ("2+((x-4)/2)**2", None)},
    )
    found, expected = (solve_problem(BOX, problem, refine=2, degree=2) for problem in (scaled, written))
    assert found.report.l2_relative < 1e-9
    assert found.coefficients == pytest.approx(expected.coefficients, abs=1e-9)


def test_elasticity_knows_the_scaled_names():
    body = iga_nn.Elasticity(exact=("X*Y", "0", "Z*Z"), traction={"v0": None})
    assert iga_nn.solve(BOX, body, refine=1, degree=2).report.l2_relative < 1e-9


def test_the_default_solution_has_no_unit():
    assert iga_nn.Poisson().exact == DEFAULT_EXACT == "exp(X+Z)*sin(Y)"
    volume = benchmark_volume(4)
    errors = [solve_problem(v, iga_nn.Poisson()).report for v in (volume, volume.transformed(1e3, [-5e5, 3e5, 100.0]))]
    assert errors[0].l2_relative == pytest.approx(errors[1].l2_relative, rel=1e-6)
    assert errors[0].h1_relative == pytest.approx(errors[1].h1_relative, rel=1e-6)
