"""Tests solve/asked/geometry.py: hollow cylinders whose radii are a little off, by the formulas of Lame and of heat."""

from collections.abc import Callable

import numpy as np
import pytest

import iga_nn
from parameterize.arrays import Array
from solve import discretize
from solve.asked.adjoint import adjoint
from solve.asked.geometry import geometry_parts
from solve.asked.samples import Samples
from solve.system import System

INNER, OUTER, RADIUS = 1.0, 2.0, 1.4
YOUNG, POISSON = 10.0, 0.3
STEP = 1e-4
HELD = ("v0", "v1", "w0", "w1")


class Cylinders:
    """The true surface: the radii of a quarter of a hollow cylinder are larger than those of the spline."""

    def __init__(self, inner: float, outer: float) -> None:
        self.inner, self.outer = inner, outer

    def offsets(self, points: Array, normals: Array) -> Array:
        """Return the difference of the radii, along the normals of the two round faces."""
        radius = np.hypot(points[:, 0], points[:, 1])
        outward = (points[:, 0] * normals[:, 0] + points[:, 1] * normals[:, 1]) / radius
        found = np.where(outward > 0.5, OUTER + self.outer - radius, 0.0)
        return np.where(outward < -0.5, radius - INNER - self.inner, found)


def _quarter() -> iga_nn.BSplineVolume:
    """Return a quarter of the cylinder, exact to 1e-4: with the radius along u."""

    def points(u: Array, v: Array, w: Array) -> tuple[Array, Array, Array]:
        radius = INNER + (OUTER - INNER) * u
        return radius * np.cos(v * np.pi / 2), radius * np.sin(v * np.pi / 2), 0.3 * w

    return iga_nn.BSplineVolume.from_function(points, (9, 9, 4))


def _shift(inner: float, outer: float) -> float:
    """Return the radial displacement at RADIUS, by Lame: plane strain, pressure 1 inside."""
    factor = inner**2 / (outer**2 - inner**2) * (1.0 + POISSON) / YOUNG
    return float(factor * ((1.0 - 2.0 * POISSON) * RADIUS + outer**2 / RADIUS))


def _heat(inner: float, outer: float) -> float:
    """Return the temperature at RADIUS: 1 inside, exchange with the factor 2 and 0 outside."""
    slope = 1.0 / (np.log(inner) - np.log(outer) - 0.5 / outer)
    return float(1.0 + slope * np.log(RADIUS / inner))


def _derivative(of: Callable[[float, float], float], way: tuple[float, float]) -> float:
    ends = [of(INNER + sign * STEP * way[0], OUTER + sign * STEP * way[1]) for sign in (1, -1)]
    return (ends[0] - ends[1]) / (2.0 * STEP)


def _changes(system: System, weights: Array) -> list[float]:
    """Return the changes of u . weights at RADIUS where the inner, and where the outer radius is off by STEP."""
    point = RADIUS * np.array([[np.cos(0.6), np.sin(0.6), 0.0]]) + [[0.0, 0.0, 0.1]]
    place = _quarter().locate(point)
    samples = Samples(np.array([0]), place, weights[:, None], np.zeros((len(weights), 3, 1)))
    solution, z = system.solve(estimate=False), adjoint(system, samples)
    surfaces = Cylinders(STEP, 0.0), Cylinders(0.0, STEP), Cylinders(0.0, 0.0)
    # the spline's own radii are off by some 1e-6
    inner, outer, none = (geometry_parts(solution, [z], surface)[0].change for surface in surfaces)
    return [(inner - none) / STEP, (outer - none) / STEP]


@pytest.mark.parametrize("formulation", ["displacement", "mixed"])
def test_a_cylinder_under_pressure(formulation: str) -> None:
    problem = iga_nn.Elasticity(young=YOUNG, poisson_ratio=POISSON, symmetry=HELD, pressure={"u0": 1.0})
    system = discretize(_quarter(), problem, formulation=formulation)
    found = _changes(system, np.array([np.cos(0.6), np.sin(0.6), 0.0]))
    assert found == pytest.approx([_derivative(_shift, (1, 0)), _derivative(_shift, (0, 1))], rel=0.01)


def test_a_load_whose_direction_is_fixed_counts_the_area() -> None:
    load = {"u0": ("x/sqrt(x*x+y*y)", "y/sqrt(x*x+y*y)", "0")}
    problem = iga_nn.Elasticity(young=YOUNG, poisson_ratio=POISSON, symmetry=HELD, load=load)
    found = _changes(discretize(_quarter(), problem), np.array([np.cos(0.6), np.sin(0.6), 0.0]))
    assert found == pytest.approx([_derivative(_shift, (1, 0)), _derivative(_shift, (0, 1))], rel=0.01)


def test_heat_through_a_cylinder() -> None:
    # one level finer: on coarse spans the flux of the adjoint through a held face is 12 % off
    problem = iga_nn.Poisson(source="0", value={"u0": 1}, exchange={"u1": (2, 0)})
    expected = [_derivative(_heat, (1, 0)), _derivative(_heat, (0, 1))]
    assert _changes(discretize(_quarter(), problem, refine=1), np.ones(1)) == pytest.approx(expected, rel=0.01)
    on_faces = iga_nn.Poisson(source="0", boundary="1", neumann=dict.fromkeys(HELD, 0), robin={"u1": (2, 0)})
    assert _changes(discretize(_quarter(), on_faces, refine=1), np.ones(1)) == pytest.approx(expected, rel=0.01)


def test_values_by_formula_follow_the_surface() -> None:
    problem = iga_nn.Poisson(source="0", boundary="x*y+z")  # harmonic: u is this on any body
    assert np.abs(_changes(discretize(_quarter(), problem), np.ones(1))).max() < 1e-3


def test_changes_that_cancel_leave_their_spread() -> None:
    system = discretize(_quarter(), iga_nn.Poisson(source="1", value={"u0": 0, "u1": 0}))
    samples = Samples(np.array([0]), np.array([[0.5, 0.5, 0.5]]), np.ones((1, 1)), np.zeros((1, 3, 1)))
    solution, z = system.solve(estimate=False), adjoint(system, samples)
    thicker = geometry_parts(solution, [z], Cylinders(-0.01, 0.01))[0]
    shifted = geometry_parts(solution, [z], Cylinders(0.01, 0.01))[0]
    assert thicker.part == pytest.approx(thicker.change, rel=0.1)
    assert abs(shifted.change) < 0.2 * thicker.change
    assert thicker.spread == pytest.approx(shifted.spread, rel=0.02)
    assert shifted.part >= shifted.spread
    assert thicker.distance == pytest.approx(0.01, rel=1e-2)
