"""Peaks of plastic solutions: nowhere more than the law allows, between the Gauss points and beyond them."""

import numpy as np
import pytest

import iga_nn
from iga_nn.report.extremes import peak_notices

YIELD, HARDENING = 235.0, 1000.0


@pytest.fixture(scope="module")
def bent():
    """A short beam on a coarse mesh, which yields where it is held."""
    body = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4.0 * u, v, w), control_points=(6, 3, 3), degree=2)
    held = [iga_nn.Fix("x < 0.01"), iga_nn.Load("nx > 0.9", (0, 0, -18.0))]
    law = iga_nn.Plasticity(
        young=210000.0, poisson_ratio=0.3, yield_strength=YIELD, hardening=HARDENING, conditions=held
    )
    return iga_nn.solve(body, law, load_steps=2)


def test_the_largest_von_mises_stress_is_one_that_the_law_allows(bent):
    flowed = bent.report.load_steps[-1].plastic_strain
    assert flowed > 1e-3
    largest = bent.extremes("von_mises").largest
    assert YIELD < largest <= (YIELD + HARDENING * flowed) * (1.0 + 1e-12)
    assert bent.extremes("plastic_strain").largest <= flowed * (1.0 + 1e-12)


def test_stress_and_plastic_strain_belong_together_at_every_point(bent):
    points = np.random.default_rng(0).random((500, 3))
    stress, strain = (bent.quantity(name, points) for name in ("von_mises", "plastic_strain"))
    assert np.all(stress <= (YIELD + HARDENING * strain) * (1.0 + 1e-12))
    tensor = np.moveaxis(bent.quantity("stress", points), 0, -1)
    deviator = tensor - np.einsum("kk...,ij->ij...", tensor, np.eye(3)) / 3.0
    assert np.allclose(np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1))), stress)


def test_a_body_that_does_not_yield_has_the_stress_of_its_strain():
    body = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=3, degree=2)
    held = [*(iga_nn.Roller(face) for face in ("u0", "v0", "w0")), iga_nn.Load("u1", (10.0, 0, 0))]
    law = iga_nn.Plasticity(young=200.0, yield_strength=20.0, conditions=held)
    stress = iga_nn.solve(body, law, load_steps=1).quantity("stress", [[0.2, 0.9, 1.0]])[0]
    assert np.allclose(stress, np.diag([10.0, 0.0, 0.0]), atol=1e-6)


def test_a_law_that_does_not_flow_has_no_limit_load():
    from solve.load_path import _why_not_all

    assert "limit load" in _why_not_all(0.8, True)
    assert "limit" not in _why_not_all(0.4, False) and "K up to 1000 times" in _why_not_all(0.4, False)


def test_a_peak_that_splines_smooth_has_a_notice(bent):
    def section(**more):
        found = bent.extremes("plastic_strain").as_dict() | more
        return {"levels": [bent.report.as_dict() | {"singular": [], "extremes": {"plastic_strain": found}}]}

    flowed = bent.report.load_steps[-1].plastic_strain
    (notice,) = peak_notices(section())
    assert notice.startswith(f"the equivalent plastic strain reaches {flowed:.4g} at a Gauss point")
    assert not peak_notices(section(largest=flowed)) and not peak_notices(section(spans=2.0, radius=0.1))
