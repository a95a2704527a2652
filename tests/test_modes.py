"""Frequencies beside what strings, rods, rooms and beams are known to have."""

from itertools import product

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh

import iga_nn
from solve import ConvergenceError

FACES = ("u0", "u1", "v0", "v1", "w0", "w1")
NOTHING = ("0", "0", "0")


def box(a, b, c, n):
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (a * u, b * v, c * w), control_points=n)


def body(free=FACES[1:], young=100.0):
    return iga_nn.Elasticity(body_force=NOTHING, traction=dict.fromkeys(free, NOTHING), young=young, poisson_ratio=0.0)


def tones(first):
    """sqrt(i^2 + (j / 1.5)^2 + (k / 2)^2) / 2, the sound of a room of 1 x 1.5 x 2, the lowest first."""
    counts = product(range(first, 6), repeat=3)
    return np.array(sorted(np.sqrt(i**2 + (j / 1.5) ** 2 + (k / 2.0) ** 2) / 2.0 for i, j, k in counts))


@pytest.mark.parametrize("is_held", [True, False], ids=["held", "free"])
def test_a_room_has_its_tones(is_held):
    law = iga_nn.Poisson(source="0", neumann={} if is_held else dict.fromkeys(FACES, "0"))
    found = iga_nn.modes(box(1.0, 1.5, 2.0, 6), law, n=3, refine=1)
    known = tones(1)[:3] if is_held else tones(0)[1:4]  # without the constant
    assert found.frequencies == pytest.approx(known, rel=2e-5)
    assert found.rigid == (0 if is_held else 1) and found.residuals.max() < 1e-4


def timoshenko(length, young):
    """The lowest frequency of a clamped beam of section 1 x 1, nu = 0, density 1, by Ritz with polynomials.

    w and the turn t of a section, both zero at the clamp: E I t'^2 + (5/6) G A (w' - t)^2 against w^2 + I t^2.
    """
    points, weights = legendre.leggauss(40)
    x, weights = 0.5 * (points + 1.0), 0.5 * length * weights
    powers = np.arange(1, 13)
    value = legendre.legvander(2.0 * x - 1.0, 11) * x[:, None]  # zero at x = 0
    slope = np.stack(
        [legendre.legval(2 * x - 1, np.eye(12)[i]) + x * 2 * legendre.legval(2 * x - 1, legendre.legder(np.eye(12)[i]))
         for i in range(len(powers))], axis=1) / length  # fmt: skip
    none, inertia = np.zeros_like(value), 1.0 / 12.0
    shear, bend = np.hstack([slope, -value]), np.hstack([none, slope])
    stiff = 5.0 / 12.0 * young * shear.T @ (weights[:, None] * shear)
    stiff += young * inertia * bend.T @ (weights[:, None] * bend)
    w, turn = np.hstack([value, none]), np.hstack([none, value])
    mass = w.T @ (weights[:, None] * w) + inertia * turn.T @ (weights[:, None] * turn)
    return np.sqrt(eigh(stiff, mass, eigvals_only=True)[0]) / (2.0 * np.pi)


def test_a_cantilever_vibrates_as_beam_theory_says():
    length, young = 10.0, 100.0
    found = iga_nn.modes(box(length, 1.0, 1.0, (16, 4, 4)), body(), n=2)
    known = timoshenko(length, young)
    euler = 1.8751**2 / (2.0 * np.pi) * np.sqrt(young / 12.0) / length**2
    assert 0.98 * euler < known < euler  # shear and turning sections lower it
    assert found.frequencies == pytest.approx([known, known], rel=1e-3)


def test_a_rod_becomes_longer_and_shorter():
    """f = sqrt(E / rho) / (4 L), exactly where nu = 0: a shape sin(pi x / 2 L) along x, of mass 1."""
    volume, density = box(2.0, 1.0, 1.0, (10, 5, 5)), 4.0
    found = iga_nn.modes(volume, body(), density, n=5)
    known = np.sqrt(100.0 / density) / 8.0
    which = np.abs(found.frequencies - known).argmin()
    assert found.frequencies[which] == pytest.approx(known, rel=1e-6)
    x = np.linspace(0.0, 1.0, 9)
    along = found.shapes[which].grid(x, [0.3], [0.8])[:, 0, 0]
    assert along[:, 0] == pytest.approx(np.sin(0.5 * np.pi * x) / np.sqrt(density), abs=1e-4)
    assert np.abs(along[:, 1:]).max() < 1e-4


def test_density_and_units():
    """Twice the mass lowers the frequencies by sqrt(2); a value on a held face does not matter."""
    volume = box(2.0, 1.0, 1.0, (6, 4, 4))
    light = iga_nn.modes(volume, body(young=2e11), 7800.0, n=2)
    moved = iga_nn.Elasticity(
        body_force=("0", "0", "-1"),
        displacement=("1", "2", "3"),
        traction=dict.fromkeys(FACES[1:], NOTHING),
        young=2e11,
        poisson_ratio=0.0,
    )
    heavy = iga_nn.modes(volume, moved, 15600.0, n=2)
    assert "loads do not matter to vibrations: body_force" in heavy.notices
    assert not any("loads" in notice for notice in light.notices)
    assert heavy.frequencies == pytest.approx(light.frequencies / np.sqrt(2.0), rel=1e-8)
    assert np.abs(heavy.shapes[0].grid([0.0], [0.3, 0.6], [0.2])).max() < 1e-15
    assert "mode  frequency" in str(light)


def test_a_free_beam_leaves_out_its_rigid_motions():
    """The first bending of a free beam is 4.7300^2 / (2 pi L^2) sqrt(E I / rho A), less what shear takes."""
    found = iga_nn.modes(box(20.0, 1.0, 1.0, (10, 4, 4)), body(FACES), n=2)
    known = 4.7300**2 / (2.0 * np.pi) * np.sqrt(100.0 / 12.0) / 20.0**2
    assert found.rigid == 6
    assert found.frequencies == pytest.approx([known, known], rel=0.02) and found.frequencies[0] < known


def test_a_law_that_is_not_symmetric_and_numbers_out_of_range_are_refused():
    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):
            return grad

    volume = box(1.0, 1.0, 1.0, 4)
    with pytest.raises(ValueError, match="Wind is not symmetric"):
        iga_nn.modes(volume, iga_nn.Problem(Wind(), source="0"))
    for wrong, says in (
        ({"density": 0.0}, "density must be"),
        ({"n": 0}, "number of modes n must be"),
        ({"n": 99}, "fewer modes"),
    ):
        with pytest.raises(ValueError, match=says):
            iga_nn.modes(volume, iga_nn.Poisson(source="0"), **wrong)
    with pytest.raises(ConvergenceError, match="residual .* after 1 iterations"):
        iga_nn.modes(box(9.0, 1.0, 1.0, (9, 4, 4)), body(), max_iterations=1)
