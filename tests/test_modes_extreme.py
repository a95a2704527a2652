"""Modes where rounding or the iteration is hard: thin bodies, stiff patches on soft ones, soft springs."""

import logging
import time

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.linalg import eigh
from scipy.optimize import brentq

import iga_nn
from iga_nn import Body, BSplineVolume, Elasticity, Poisson
from solve import ConvergenceError
from solve.lowest import Vectors, ritz

FACES = ("u0", "u1", "v0", "v1", "w0", "w1")
NOTHING = ("0", "0", "0")
FREE = {"traction": dict.fromkeys(FACES, NOTHING)}
TURN = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
CIRCLE = 2.0 * np.pi


def slab(a, b, c, n, degree=3, turn=None):
    turn = np.eye(3) if turn is None else turn
    return BSplineVolume.from_function(
        lambda u, v, w: tuple(row[0] * a * u + row[1] * b * v + row[2] * c * w for row in turn), n, degree
    )


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["along the axes", "turned"])
def test_thin_foils_have_the_modes_of_a_thicker_one(turn):
    """Bending frequencies are proportional to the thickness, to its square: 5e-5 has those of 1e-3."""
    law = Elasticity(young=1.0, poisson_ratio=0.3, **FREE)
    for thickness in (1e-3, 5e-5):
        found = iga_nn.modes(slab(1.0, 1.0, thickness, (5, 5, 4), turn=turn), law, n=4)
        assert found.rigid == 6 and all("spans" in one for one in found.notices)
        assert found.frequencies / thickness == pytest.approx([0.658, 1.081, 1.473, 1.889], rel=1e-3)


def test_a_thin_rod_of_degree_2_bends_as_a_parabola():
    """1 : 20 000: the one shape of degree 2 without shear has w'' = 1, E I w''^2 over rho A w^2 is 720 t^2 / 12."""
    rod = slab(1.0, 5e-5, 5e-5, (6, 3, 3), 2, TURN)
    found = iga_nn.modes(rod, Elasticity(young=1.0, poisson_ratio=0.0, **FREE), n=2)
    assert found.rigid == 6
    assert found.frequencies / 5e-5 == pytest.approx(np.sqrt(60.0) / CIRCLE, rel=1e-3)


@pytest.mark.slow
def test_a_thin_rod_bends_as_beam_theory_says():
    """1 : 20 000: 4.7300^2 and 7.8532^2 over 2 pi sqrt(12), each twice."""
    rod = slab(1.0, 5e-5, 5e-5, (60, 6, 6))
    found = iga_nn.modes(rod, Elasticity(young=1.0, poisson_ratio=0.0, **FREE), n=4)
    known = np.repeat([4.7300, 7.8532], 2) ** 2 / CIRCLE / np.sqrt(12.0)
    assert found.rigid == 6
    assert found.frequencies / 5e-5 == pytest.approx(known, rel=1e-3)


def bars():
    parts = [(0.0, 0.5), (0.5, 1.5)]
    return Body.from_patches(
        [
            BSplineVolume.from_function(lambda u, v, w, a=a, b=b: (a + (b - a) * u, v, 0.5 * w), (5, 4, 3), 2)
            for a, b in parts
        ]
    )


@pytest.mark.parametrize("contrast", [1e5, 1e-5])
def test_a_stiff_bar_on_a_soft_one_is_a_mass(contrast):
    """A mass m at the end of a bar of length l: tan(k l) = -k m, with k = omega / sqrt(kappa)."""
    mass, length = (0.5, 1.0) if contrast > 1.0 else (1.0, 0.5)
    started = time.monotonic()
    found = iga_nn.modes(bars(), Poisson(kappa={0: contrast, 1: 1.0}, conditions=[iga_nn.Flux("x > -1", 0.0)]), n=3)
    assert found.rigid == 1 and time.monotonic() - started < 30.0
    k = brentq(lambda k: np.sin(k * length) + k * mass * np.cos(k * length), 0.51 * np.pi / length, np.pi / length)
    assert found.frequencies[0] == pytest.approx(k * min(contrast, 1.0) ** 0.5 / CIRCLE, rel=3e-3)


@pytest.mark.parametrize("contrast", [1e5, 1e-5])
def test_a_stiff_elastic_bar_swings_on_a_soft_one(contrast):
    """With 1e5 in place of 1e8 nothing changes but the size of what is left of the stiff bar's own shape."""
    one, other = (
        iga_nn.modes(bars(), Elasticity(young={0: ratio, 1: 1.0}, poisson_ratio=0.3, **FREE), n=2)
        for ratio in (contrast, contrast ** (8 / 5))
    )
    assert one.rigid == other.rigid == 6
    scale = 1.0 if contrast > 1.0 else contrast**-0.3
    assert other.frequencies * scale == pytest.approx(one.frequencies, rel=1e-3)


@pytest.mark.parametrize("stiffness", [1e-9, 1e-5])
def test_soft_springs_move_a_stiff_block_as_a_rigid_body(stiffness):
    """Springs alone, on the face x = 0: all six modes are a rigid body's, by integrals over the box and the face."""
    size = np.array([2.0, 1.2, 1.0])
    points, weights = leggauss(3)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    x = np.stack(np.meshgrid(*(points * side for side in size), indexing="ij")).reshape(3, -1)
    volume = np.prod(size) * np.einsum("i,j,k->ijk", weights, weights, weights).ravel()

    def gram(x, weights):
        shifts = np.eye(3)[:, :, None] * np.ones(x.shape[1])
        motions = np.concatenate([shifts, [np.cross(axis, x, axisb=0).T for axis in np.eye(3)]])
        return np.einsum("kcm,lcm,m->kl", motions, motions, weights)

    face = stiffness * gram(np.array([[0.0], [1.0], [1.0]]) * x, volume / size[0])
    known = np.sqrt(eigh(face, gram(x, volume), eigvals_only=True)) / CIRCLE
    law = Elasticity(spring={"nx < -0.5": stiffness}, young=1.0, poisson_ratio=0.3)
    found = iga_nn.modes(slab(*size, 3, 2), law, n=7)
    assert found.rigid == 0
    assert found.frequencies[:6] == pytest.approx(known, rel=1e-3 if stiffness > 1e-6 else 1e-6)
    assert found.frequencies[6] > 0.1


@pytest.mark.parametrize("data", ["robin", "exchange", "reaction"])
def test_soft_exchange_moves_the_constant(data):
    """f = sqrt(alpha area / volume) / 2 pi, of a reaction sqrt(c) / 2 pi."""
    given = {
        "robin": {"neumann": dict.fromkeys(FACES[1:], "0"), "robin": {"u0": ("1e-7", "0")}},
        "exchange": {"exchange": {"nx < -0.5": ("1e-7", "0")}},
        "reaction": {"neumann": dict.fromkeys(FACES, "0"), "reaction": "1e-7"},
    }[data]
    found = iga_nn.modes(slab(2.0, 1.2, 1.0, 4), Poisson(source="0", **given), n=2)
    known = np.sqrt(1e-7 if data == "reaction" else 1e-7 / 2.0) / CIRCLE
    assert found.rigid == 0
    assert found.frequencies == pytest.approx([known, 0.25], rel=1e-3)


def test_all_modes_of_a_small_space():
    """On one element of degree 1 there are 24: 6 rigid motions, and 3 shears of frequency sqrt(3 mu) / pi ."""
    cube = slab(1.0, 1.0, 1.0, 2, 1)
    found = iga_nn.modes(cube, Elasticity(young=1.0, poisson_ratio=0.0, **FREE), n=18)
    assert found.rigid == 6 and len(found.shapes) == 18
    # u_x = y - 1/2, u_y = x - 1/2: energy 2 * 2 mu of mass 1/6, mu = 1/2; u_x = x - 1/2: energy 2 mu of mass 1/12
    assert np.isclose(found.frequencies, np.sqrt(12.0) / CIRCLE, rtol=1e-6).sum() >= 6
    with pytest.raises(ValueError, match="n 19: the space has 24 unknowns, fewer modes"):
        iga_nn.modes(cube, Elasticity(**FREE), n=19)


def test_what_cannot_be_found_is_refused_in_one_line():
    class Growing(iga_nn.Form):
        def flux(self, u, grad, x):
            return grad

        def react(self, u, grad, x):
            return -100.0 * u

    with pytest.raises(ValueError, match="the energy of some motion is not positive"):
        iga_nn.modes(slab(2.0, 1.2, 1.0, 4), iga_nn.Problem(Growing(), source="0"), n=2)
    with pytest.raises(ConvergenceError, match=r"residual .* after \d\d iterations, tolerance 1e-16"):
        iga_nn.modes(slab(2.0, 1.2, 1.0, 4), Poisson(source="0"), n=2, tolerance=1e-16)
    with pytest.raises((ValueError, ConvergenceError), match="longer than thick|too slender"):
        iga_nn.modes(slab(1.0, 1.0, 1e-7, (5, 5, 4), turn=TURN), Elasticity(**FREE), n=2)


def test_dependent_columns_and_small_eigenvalues_beside_large_ones():
    """Eigenvalues 1e-4, 1 and 1e4 of a diagonal matrix come from columns of which one is given twice."""
    values = np.array([1e-4, 1.0, 1e4, 3.0])
    x = np.random.default_rng(0).standard_normal((4, 3))
    x = np.concatenate([np.eye(4)[:, :3] @ x[:3], np.eye(4)[:, :1]], axis=1)
    found, weights = ritz(Vectors(x, values[:, None] * x, x), 4)
    assert found == pytest.approx(values[:3], rel=1e-3)
    assert np.linalg.norm(x @ weights, axis=0) == pytest.approx(1.0, rel=1e-6)


def test_a_long_search_says_how_far_it_is(monkeypatch, caplog):
    monkeypatch.setattr("solve.lowest.TOLD", 0.0)
    with caplog.at_level(logging.INFO, "solve.lowest"):
        iga_nn.modes(slab(2.0, 1.2, 1.0, 4), Poisson(source="0"), n=2)
    assert "modes: residual" in caplog.text
