import numpy as np
import pytest

from parameterize.spline.volume import BSplineVolume
from solve import ConvergenceError, Poisson, solve_problem
from solve.discretization.space import trial_space
from solve.failure import worst_place


def pressed_corner(height):
    """The trilinear unit cube with its corner (1, 1, 1) moved down to (1, 1, height)."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    corners[1, 1, 1, 2] = height
    return BSplineVolume.uniform(corners, 1)


def test_worst_place_is_found_near_the_pressed_corner():
    """Of the two Gauss points a direction, the one nearest the corner: (1 + 1 / sqrt 3) / 2 = 0.7887 three times."""
    volume = pressed_corner(0.1)
    parameters, point, scaled = worst_place(volume, trial_space(volume))
    assert parameters == pytest.approx([0.788675] * 3, abs=1e-6)
    assert point == pytest.approx(volume(parameters[None])[0])
    jacobian = volume.jacobian(parameters[None])[0]
    assert scaled == pytest.approx(np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=0).prod())


def test_the_line_of_a_failed_solve_has_history_and_place():
    with pytest.raises(ConvergenceError) as caught:
        solve_problem(pressed_corner(0.1), Poisson(exact="sin(9*x)*y*z"), refine=2, max_iterations=2, strict=True)
    line = str(caught.value)
    assert "residual 1.0e+00 at the start" in line and "after 2 iterations" in line and "\n" not in line
    assert "the map is worst at u=0.9" in line
    assert caught.value.solution.report.notices == (line,)
