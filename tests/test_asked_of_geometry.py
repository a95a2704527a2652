"""Tests solve/asked/of_geometry.py and own_change.py: each quantity on a hollow cylinder against a second solve."""

import numpy as np
import pytest

import iga_nn
from parameterize.arrays import Array
from solve import discretize
from solve.ask import Ask
from solve.asked.functional import functional
from solve.asked.geometry import GeometryPart
from solve.asked.of_geometry import NO_SURFACE, of_geometry

STEP = 1e-3
HELD = ("v0", "v1", "w0", "w1")
ON_ARC = "1.6506712298, 1.1292849468, 0.1"  # radius 2


class Larger:
    """The true surface: the radii of the two round faces, 1 and 2, are larger by these steps."""

    def __init__(self, inner: float, outer: float) -> None:
        self.steps = inner, outer

    def offsets(self, points: Array, normals: Array) -> Array:
        """Return the steps along the normals."""
        outward = (points[:, :2] * normals[:, :2]).sum(axis=1) / np.hypot(*points[:, :2].T)
        return np.where(outward > 0.5, self.steps[1], np.where(outward < -0.5, -self.steps[0], 0.0))


def _quarter(inner: float = 1.0, outer: float = 2.0) -> iga_nn.BSplineVolume:
    def points(u: Array, v: Array, w: Array) -> tuple[Array, Array, Array]:
        radius = inner + (outer - inner) * u
        return radius * np.cos(v * np.pi / 2), radius * np.sin(v * np.pi / 2), 0.3 * w

    return iga_nn.BSplineVolume.from_function(points, (9, 9, 4))


def _demand_changes(problem: iga_nn.Poisson | iga_nn.Elasticity, asks: dict[str, float], refine: int) -> None:
    """Compare the changes of quantities with those of a second solve; asks: with the share that may be wrong."""
    system = discretize(_quarter(), problem, refine=refine)
    solution = system.solve(estimate=False)
    every = [functional(Ask(text), problem, _quarter()) for text in asks]
    base = [one.value(solution) for one in every]
    for steps in ((STEP, 0.0), (0.0, STEP)):
        other = _quarter(1.0 + steps[0], 2.0 + steps[1])
        solved = discretize(other, problem, refine=refine).solve(estimate=False)
        for one, before, found in zip(every, base, of_geometry(system, solution, every, Larger(*steps)), strict=True):
            true = functional(Ask(one.ask.text), problem, other).value(solved) - before
            assert isinstance(found, GeometryPart)
            assert found.change == pytest.approx(true, rel=asks[one.ask.text]), one.ask.text
            assert found.part >= abs(found.change)
            assert found.distance == STEP


def test_quantities_of_a_pressed_cylinder() -> None:
    problem = iga_nn.Elasticity(young=10.0, symmetry=HELD, pressure={"u0": 1.0})
    asks = {
        "energy": 0.02,
        f"ux at ({ON_ARC})": 0.02,
        "magnitude max": 0.1,
        "mean von_mises": 0.02,
    }
    _demand_changes(problem, asks, refine=0)


def test_quantities_of_heat() -> None:
    problem = iga_nn.Poisson(source="1", value={"u0": 1, "u1": 0.5})
    asks = {"energy": 0.05, "mean u": 0.05, "reaction of u0": 0.05, "flow over u1": 0.05}
    _demand_changes(problem, asks, refine=0)


def test_a_reaction_of_one_support_keeps_its_load() -> None:
    weak = iga_nn.Elasticity(fix="z < 1e-6", load={"z > 0.299": (0, 0, 1)})
    strong = iga_nn.Elasticity(fix="w0", load={"w1": (0, 0, 1)})
    for problem in (weak, strong):
        system = discretize(_quarter(), problem)
        solution = system.solve(estimate=False)
        region = problem.conditions[0].region
        one = functional(Ask(f"reaction z of {region}"), problem, _quarter())
        (found,) = of_geometry(system, solution, [one], Larger(STEP, STEP))
        assert isinstance(found, GeometryPart)
        assert found.part < 0.01 * STEP * abs(one.value(solution))


def test_without_a_surface_nothing_is_known() -> None:
    problem = iga_nn.Poisson(source="1", value={"u0": 1})
    system = discretize(_quarter(), problem)
    one = functional(Ask("energy"), problem, _quarter())
    assert of_geometry(system, system.solve(estimate=False), [one]) == [NO_SURFACE]


def test_an_interval_has_the_part_of_the_distance() -> None:
    part = iga_nn.sample("cube").part
    box = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, (1.0 + STEP) * w), 4)
    problem = iga_nn.Elasticity(fix="z < 1e-6", load={"nz > 0.9": (0, 0, 1)}, poisson_ratio=0.0)
    ask = ["mean uz over nz > 0.9", "reaction z of z < 1e-6"]
    plain = iga_nn.solve(box, problem, ask=ask, estimate=False).answers
    known = iga_nn.solve(box, problem.on_surface(part), ask=ask, estimate=False).answers
    assert "geometry" not in plain[0].parts and plain[0].why.endswith("geometry: not known, no surface is given")
    assert known[0].parts["geometry"] == pytest.approx(STEP, rel=0.1)  # u = 1.001 in the place of 1
    assert known[0].lower is not None and known[0].upper is not None
    assert known[0].lower < 1.0 < known[0].upper and known[0].why.endswith("geometry: 0.001 off the surface at most")
    assert known[1].parts["geometry"] < 1e-6
