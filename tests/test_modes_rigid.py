"""How many rigid motions are left out: those that the supports leave, counted by hand."""

from itertools import product

import numpy as np
import pytest

import iga_nn
from iga_nn import Body, BSplineVolume, Elasticity, Poisson
from iga_nn.options.analysis import ModesOptions
from iga_nn.report.document import verdict
from iga_nn.workflow import pipeline

FACES = ("u0", "u1", "v0", "v1", "w0", "w1")
NOTHING = ("0", "0", "0")
FREE = {"traction": dict.fromkeys(FACES, NOTHING)}
OPEN = {"source": "0", "neumann": dict.fromkeys(FACES, "0")}
SIZE = np.array([2.0, 1.2, 1.0])


def box(start=0.0, hand=1, degree=2):
    return BSplineVolume.from_function(
        lambda u, v, w: (start + SIZE[0] * u, SIZE[1] * v, hand * SIZE[2] * w), degree + 1, degree
    )


def held(**supports):
    return Elasticity(young=1.0, poisson_ratio=0.3, **supports)


class Own(iga_nn.Form):
    """Elasticity with nu = 0, as a user writes it: nothing says that rotations take no energy."""

    components = 3

    def flux(self, u, grad, x):
        return grad + np.swapaxes(grad, 0, 1)


class Springs(Own):
    """The same with a bedding along x in one corner alone."""

    def react(self, u, grad, x):
        pull = np.zeros_like(u)
        pull[0] = np.where(x[0] < 0.5, 1e-6, 0.0) * u[0]
        return pull


class Components(iga_nn.Form):
    """Three components that have nothing to do with each other."""

    components = 3

    def flux(self, u, grad, x):
        return grad


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (held(**FREE), 6),
        (held(roller="nx < -0.5"), 3),  # two shifts, and the turn about x
        (held(symmetry="nx < -0.5"), 3),
        (held(roller="abs(nz) > 0.5"), 3),
        (held(roller=["nx < -0.5", "ny < -0.5"]), 1),  # the shift along z
        (held(roller=["nx < -0.5", "ny < -0.5", "nz < -0.5"]), 0),
        (held(fix={"u0": ["0", None, None]}), 3),
        (held(fix={"u0": ["0", "0", None], "v0": [None, "0", None]}), 1),
        (held(fix="u0 and y < 0.5"), 0),
        (held(displacement=NOTHING, traction=dict.fromkeys(FACES[1:], NOTHING)), 0),
        (held(spring={"nx < -0.5": 1e-9}), 0),
        (held(spring={"nx < -0.5": 0.0}), 6),
        (held(roller="nz < -0.5", spring={"nx < -0.5 and y < 0.5": 1e-9}), 0),
        (held(load={"nx < -0.5": NOTHING}), 6),
        (Poisson(**OPEN), 1),
        (Poisson(kappa=[[1.0, 0.0, 0.0], [0.0, 1e-13, 0.0], [0.0, 0.0, 1.0]], **OPEN), 1),
        (Poisson(source="0", value="u0 and y < 0.5"), 0),
        (Poisson(source="0", exchange={"nx > 0.5": ("1e-9", "0")}), 0),
        (Poisson(source="0", neumann=dict.fromkeys(FACES[1:], "0"), robin={"u0": ("1e-9", "0")}), 0),
        (Poisson(source="0", neumann=dict.fromkeys(FACES[1:], "0"), robin={"u0": ("0", "0")}), 1),
        (Poisson(reaction="1e-9", **OPEN), 0),
        (iga_nn.Problem(Own(), source=NOTHING, neumann=dict.fromkeys(FACES, NOTHING)), 6),
        (iga_nn.Problem(Springs(), source=NOTHING, neumann=dict.fromkeys(FACES, NOTHING)), 3),
        (iga_nn.Problem(Components(), source=NOTHING, neumann=dict.fromkeys(FACES, NOTHING)), 3),
        (iga_nn.Problem(Components(), source=NOTHING, value={"u0": ["0", "0", "0"]}), 0),
    ],
)
def test_motions_that_supports_leave(law, expected):
    found = iga_nn.modes(box(), law, n=1)
    assert found.rigid == expected and found.notices == ()
    assert found.frequencies[0] > 0.0


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_hands_and_degrees(degree):
    right, left = (iga_nn.modes(box(hand=hand, degree=degree), held(**FREE), n=3) for hand in (1, -1))
    assert right.rigid == left.rigid == 6
    assert left.frequencies == pytest.approx(right.frequencies, rel=1e-6)


@pytest.mark.parametrize("supports", [{}, {"roller": "nx < -0.5"}, {"fix": "p0_u0"}], ids=str)
def test_each_part_has_its_own_motions(supports):
    law = held(**(supports or FREE))
    of_one = {"": 6, "roller": 3, "fix": 0}[next(iter(supports), "")]
    glued = Body.from_patches([box(0.0), box(2.0)])
    apart = Body.from_patches([box(0.0), box(5.0)])
    assert iga_nn.modes(glued, law, n=1).rigid == of_one
    assert iga_nn.modes(apart, law, n=1).rigid == of_one + (6 if "fix" in supports else of_one)
    warm = iga_nn.modes(apart, Poisson(**OPEN), n=1)
    one_element = 12.0**0.5 / SIZE[0] / (2.0 * np.pi)  # a straight line is the best of its shapes
    assert warm.rigid == 2 and warm.frequencies[0] == pytest.approx(one_element, rel=1e-6)


def quarter(turn=0.0, hand=1):
    """A quarter of a ring of radii 1 and 2 and height 1, exactly, as NURBS."""
    net, weights = np.zeros((2, 3, 2, 3)), np.ones((2, 3, 2))
    weights[:, 1] = 0.5**0.5
    about = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    for i, j, k in product(range(2), range(3), range(2)):
        net[i, j, k, :2] = (1.0 + i) * (about @ [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][j])
        net[i, j, k, 2] = hand * k
    line, arc = np.array([0.0, 0.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    return BSplineVolume((1, 2, 1), (line, arc, line), net, weights=weights)


def test_a_rational_body_turns_in_a_curved_roller():
    """The inner cylinder leaves the shift along its axis and the turn about it; splines contain the latter nearly."""
    how = {"n": 1, "refine": 1, "degree": 2}
    assert iga_nn.modes(quarter(), held(roller="u0"), **how).rigid == 2
    half = Body.from_patches([quarter(0.5 * np.pi * k) for k in range(2)])
    assert iga_nn.modes(half, held(roller="u0"), n=1, degree=2).rigid == 2
    right, left = (iga_nn.modes(quarter(hand=hand), held(**FREE), n=3, refine=2, degree=2) for hand in (1, -1))
    assert right.rigid == left.rigid == 6
    assert left.frequencies == pytest.approx(right.frequencies, rel=1e-6)


def test_a_space_without_the_rotations_says_so():
    bent = BSplineVolume.from_function(lambda u, v, w: ((1 + u) * np.cos(1.5 * v), (1 + u) * np.sin(1.5 * v), w), 4)
    found = iga_nn.modes(bent, held(**FREE), n=1, degree=1)
    assert found.rigid == 6 and "contains the rigid motions only nearly" in found.notices[0]
    assert iga_nn.modes(bent, held(**FREE), n=1).notices == ()


def test_the_report_says_so_too(tmp_path):
    bent = BSplineVolume.from_function(lambda u, v, w: ((1 + u) * np.cos(1.5 * v), (1 + u) * np.sin(1.5 * v), w), 4)
    bent.save(tmp_path / "bent.npz")
    options = ModesOptions(number=1, degree=1)
    outcome, _ = pipeline.modes_to(tmp_path / "bent.npz", tmp_path / "modes", modes_options=options)
    notice, spans = outcome.report["modes"]["notices"]
    assert "refine until the frequencies stay" in notice and "times as long as the body is thick" in spans
    assert verdict(outcome.report, outcome.folder)["modes"]["notices"] == [notice, spans]
    assert notice in (tmp_path / "modes" / "report.html").read_text()


def test_a_foil_that_is_held_along_its_edge_does_not_turn_about_it():
    """The turn moves the edge's points by 2e-5 only: what counts is which part of their motion is held."""
    foil = BSplineVolume.from_function(lambda u, v, w: (u, v, 2e-5 * w), 3, 2)
    weak, strong = (iga_nn.modes(foil, held(fix=where), n=1) for where in ("u0 and y > -1", "u0"))
    assert weak.rigid == strong.rigid == 0
    assert weak.frequencies == pytest.approx(strong.frequencies, rel=0.05)  # of few spans
