"""Tests solve/asked/adjoint.py: J(u_h) is the load at the adjoint, and adjoints are symmetric."""

import numpy as np
import pytest

import iga_nn
from parameterize.arrays import Array
from solve import benchmark_volume, discretize
from solve.asked.adjoint import adjoint, adjoint_of, right_of
from solve.asked.samples import Samples
from solve.field import BodyField
from solve.mixed import MixedSystem
from solve.solution import PatchSolution
from solve.system import System


def _rod() -> iga_nn.Body:
    """Return two bent patches that are glued."""
    parts = [
        iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v + 0.1 * (u + a) * w, w), 4) for a in (0, 1)
    ]
    return iga_nn.Body.from_patches(parts)


def _samples(system: System, seed: int) -> Samples:
    """Return a functional of random weights at random points."""
    rng, count, c = np.random.default_rng(seed), 30, system.problem.form.components
    rows = c + (system.formulation == "mixed")
    patches = rng.integers(0, len(system.patches), count)
    return Samples(
        patches, rng.random((count, 3)), rng.standard_normal((rows, count)), rng.standard_normal((c, 3, count))
    )


def _value(system: System, samples: Samples, field: BodyField) -> float:
    """Return the functional of a field, evaluated point by point."""
    total = 0.0
    for i, (number, place) in enumerate(zip(samples.patches, samples.places, strict=True)):
        own = field.patches[number]
        problem = system.stated[number].problem
        patch = PatchSolution(
            own.degrees, own.knots, own.coefficients, system.body.patches[number], own.pressure, problem=problem
        )
        u = patch.quantity(lambda u, grad, x: u if x.pressure is None else np.append(u, x.pressure[None], 0), place)
        total += samples.of_u[:, i] @ u[0] + np.sum(samples.of_grad[:, :, i] * patch.quantity("gradient", place)[0])
    return float(total)


PROBLEMS = {
    "poisson": iga_nn.Poisson(conditions=[iga_nn.Value("x < 0.01"), iga_nn.Exchange("x > 1.99", 2, 3)], source="1+x"),
    "elastic": iga_nn.Elasticity(fix="x < 0.01", load={"x > 1.99": (0, 0, 1)}),
    "open": iga_nn.Poisson(conditions=[iga_nn.Flux("x < 0.01", -1), iga_nn.Flux("x > 1.99", 1)]),
    "mixed": iga_nn.Elasticity(fix="x < 0.01", load={"x > 1.99": (0, 0, 1)}, poisson_ratio=0.49),
}


@pytest.mark.parametrize("name", ["poisson", "elastic", "open"])
def test_the_load_at_the_adjoint_is_the_functional(name: str) -> None:
    system = discretize(_rod(), PROBLEMS[name])
    samples = _samples(system, 0)
    value = _value(system, samples, system.solve(tolerance=1e-12, estimate=False).field)
    assert system.load @ system.vector(adjoint(system, samples, 1e-12)) == pytest.approx(value, rel=1e-8)


def test_values_on_faces_are_given() -> None:
    system = discretize(
        benchmark_volume(3), iga_nn.Elasticity(body_force=("x", "1", "0"), displacement=("0", "0", "0"))
    )
    samples = _samples(system, 0)
    value = _value(system, samples, system.solve(tolerance=1e-12, estimate=False).field)
    z = adjoint(system, samples, 1e-12)
    assert np.all(z([[0.0, 0.3, 0.4]]) == 0.0)
    assert system.load @ system.vector(z) == pytest.approx(value, rel=1e-8)


@pytest.mark.slow
def test_mixed_adjoints_are_symmetric() -> None:
    system = discretize(_rod(), PROBLEMS["mixed"])
    assert isinstance(system, MixedSystem)
    one, other = _samples(system, 0), _samples(system, 1)
    found: list[Array] = [
        np.array(_value(system, own, adjoint(system, rest, 1e-11))) for own, rest in ((one, other), (other, one))
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    u_h = adjoint_of(system, system.load, 1e-11)  # the matrix is symmetric: the load is the functional of u_h
    expected = system.solve(tolerance=1e-11).field
    assert np.allclose(u_h.patches[1].coefficients, expected.patches[1].coefficients, rtol=1e-5, atol=1e-6)
    assert right_of(system, one).shape == system.load.shape


def test_a_law_that_is_not_symmetric_has_no_adjoint() -> None:
    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):  # type: ignore[no-untyped-def]
            return 0.1 * grad

        def react(self, u, grad, x):  # type: ignore[no-untyped-def]
            return grad[:, 0]

    system = discretize(benchmark_volume(2), iga_nn.Problem(Wind(), exact="x*y"))
    with pytest.raises(ValueError, match="not symmetric"):
        adjoint(system, _samples(system, 0))
