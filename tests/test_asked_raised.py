"""The raised space, the start of its iteration, and its solution."""

import numpy as np
import pytest
from cube_grids import two

import iga_nn
from iga_nn import Elasticity, Poisson
from solve import benchmark_volume
from solve.asked.raised import Raised, evened, raised_knots, start_in
from solve.options import SolveOptions
from solve.preparation import discretized
from solve.reactions import Balance


def solved(body, problem, **how):
    options = SolveOptions(threads=1, **how)
    system = discretized(body, problem, options)
    return system, system.solve_with(options), options


def test_raised_knots_are_as_smooth_as_the_map_and_divide_the_ends():
    of_map, halved = np.array([0, 0, 0, 0.5, 1, 1, 1]), np.array([0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1])
    np.testing.assert_allclose(
        raised_knots(halved, 2, of_map, 2, is_divided=False), [0] * 4 + [0.25, 0.5, 0.5, 0.75] + [1] * 4
    )
    np.testing.assert_allclose(
        raised_knots(of_map, 2, of_map, 2, is_divided=True), [0] * 4 + [1 / 8, 1 / 4, 0.5, 0.5, 3 / 4, 7 / 8] + [1] * 4
    )
    kink = np.array([0, 0, 0, 0.5, 0.5, 1, 1, 1])  # of a degree below that of the map
    np.testing.assert_allclose(
        raised_knots(kink, 2, np.repeat([0, 0.5, 1], [4, 3, 4]), 3, False), [0] * 4 + [0.5] * 3 + [1] * 4
    )
    single = np.array([0.0, 0, 1, 1])
    np.testing.assert_allclose(raised_knots(single, 1, single, 1, is_divided=True), [0] * 3 + [0.5] + [1] * 3)
    np.testing.assert_allclose(raised_knots(single, 1, single, 1, is_divided=False), [0] * 3 + [1] * 3)


@pytest.mark.parametrize("body", [benchmark_volume(3, 2), two(2, 2)])
def test_a_solution_in_the_raised_space_of_the_raised_solution(body):
    """On a space that contains the solution the start has all of its values, and the iteration nothing to do."""
    system, solution, options = solved(body, Poisson(source="1+x"), estimate=False)
    higher = discretized(body, Poisson(source="1+x"), SolveOptions(threads=1, degree=3))  # keeps the map's smoothness
    field = higher.field(start_in(higher, solution))
    places = np.random.default_rng(0).uniform(size=(20, 3))
    for own, new in zip(solution.patches, field.patches, strict=True):
        np.testing.assert_allclose(new(places), own(places), atol=1e-12)


def test_the_raised_solution_has_what_a_cubic_solution_lacks():
    problem = Poisson(exact="x**4+y*z**4")
    system, solution, options = solved(two(3, 3), problem, tolerance=1e-11)
    raised = Raised.of(system, solution, options)
    assert raised.is_divided and raised.solution.report.iterations < solution.report.iterations
    points = [[0.3, 0.2, 0.7], [1.6, 0.5, 0.1]]
    exact = np.array([x**4 + y * z**4 for x, y, z in points])
    before, after = (np.abs(one.probe(points) - exact).max() for one in (solution, raised.solution))
    assert after < 0.02 * before


@pytest.mark.slow
def test_pressures_are_raised_too():
    bar = Elasticity(poisson_ratio=0.49, fix="u0", load={"u1": (0, 0, -1)})
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u, v, w), (5, 4, 4), 2)
    system, solution, options = solved(volume, bar)
    raised = Raised.of(system, solution, options)
    assert raised.solution.report.formulation == "mixed"
    assert 4 * raised.solution.report.iterations < solution.report.iterations + 20
    field = system.field(start_in(system, solution))  # its own space
    np.testing.assert_allclose(field.only.pressure, solution.only.pressure, atol=1e-9)


def test_reactions_take_what_the_iteration_leaves():
    balance = Balance((1.0, 0.0), {"a": (-0.6, 0.0), "b": (-0.3, 0.0)}, {}, 0.05)
    reactions = evened(balance).reactions
    np.testing.assert_allclose([reactions["a"], reactions["b"]], [(-2 / 3, 0), (-1 / 3, 0)])
    assert evened(None) is None
