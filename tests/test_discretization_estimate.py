"""The estimated error beside the true one, which is measured against a much finer solution on the same map."""

import numpy as np
import pytest
from volumes import bent

from parameterize.spline.bspline import breakpoints, gauss_points, greville, open_uniform_knots
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Elasticity, Form, Poisson, Problem, benchmark_volume, solve_problem
from solve.discretization.waves import lowest_waves

WAVE = "exp(x+z)*sin(y)"
TENSOR = ("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z")


def effectivity(volume, problem, **arguments):
    report = solve_problem(volume, problem, estimate=True, **arguments).report
    assert report.error_estimate_relative == pytest.approx(report.error_estimate / report.l2 * report.l2_relative, 1e-3)
    return report.error_estimate / report.l2


@pytest.mark.parametrize("degree", [2, 3, *(pytest.param(degree, marks=pytest.mark.slow) for degree in (4, 5))])
def test_estimate_is_near_the_error(degree):
    assert 0.5 < effectivity(benchmark_volume(4, degree), Poisson(exact=WAVE), refine=1) < 1.5


@pytest.mark.parametrize(
    "problem",
    [
        Poisson(exact="sin(5*x)*cos(4*y)+z**3"),
        Poisson(exact=WAVE, kappa="1+x*x+y"),
        Poisson(exact=WAVE, kappa=TENSOR, reaction="x*x", neumann={"u1": None}, robin={"w0": ("2+x", None)}),
        Poisson(exact=WAVE, reaction="1000"),
        Poisson(exact=WAVE, neumann=dict.fromkeys(FACE_NAMES)),
    ],
    ids=["waves", "kappa", "all terms", "large reaction", "pure neumann"],
)
def test_estimate_holds_for_every_term(problem):
    assert 0.8 < effectivity(benchmark_volume(4), problem, refine=1) < 1.5


def test_estimate_holds_where_elements_are_flat():
    """In a box 1 x 1 x 1/8 of a cube's knots, errors along x and along z are judged by the sizes of their own."""
    points = greville(open_uniform_knots(7, 3), 3)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    box = BSplineVolume.uniform(grid * [1.0, 1.0, 0.125], 3)
    for exact in ("sin(3*x)*cos(2*y)", "sin(20*z)", "sin(3*x)+sin(20*z)"):
        assert 0.8 < effectivity(box, Poisson(exact=exact), refine=1) < 1.5


def test_estimate_of_displacements_is_on_the_safe_side():
    body = Elasticity(exact=("exp(x)*sin(y)", "cos(x*z)", "x*y*z+sin(z)"), traction={"u1": None}, young=210.0)
    report = solve_problem(benchmark_volume(4), body, refine=1, estimate=True).report
    assert 1.0 < report.error_estimate / report.l2 < 4.0


def test_no_estimate_where_derivatives_jump_or_are_unknown():
    plain = Poisson(source="1")
    assert solve_problem(benchmark_volume(4, 1), plain).report.error_estimate is None
    assert solve_problem(benchmark_volume(4), plain).report.error_estimate > 0.0
    unknown = Poisson(source="1", kappa=lambda x, y, z: 1 + x * x)
    assert solve_problem(benchmark_volume(4), unknown).report.error_estimate is None
    assert solve_problem(benchmark_volume(4), Poisson(exact=WAVE)).report.error_estimate is None  # not asked for


def box(size, spans, degree=3):
    """A box whose control points are evenly spaced: its spans at the ends are longer, and det J varies in them."""
    knots = [open_uniform_knots(n + degree, degree) for n in spans]
    rows = [np.linspace(0.0, length, n + degree) for length, n in zip(size, spans, strict=True)]
    grid = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    return BSplineVolume((degree,) * 3, tuple(knots), grid)


def on_knots(inner, function, degree=3):
    """The volume with control points function(u, v, w) at evenly spaced u, v, w, and given inner knots."""
    knots = [np.concatenate([np.zeros(degree + 1), row, np.ones(degree + 1)]) for row in inner]
    u, v, w = np.meshgrid(*(np.linspace(0.0, 1.0, len(row) - degree - 1) for row in knots), indexing="ij")
    return BSplineVolume((degree,) * 3, tuple(knots), np.stack(np.broadcast_arrays(*function(u, v, w)), axis=-1))


def finer(knots, parts, layer):
    """Return knots with every span divided, and more towards both ends, down to a layer (0 for none)."""
    breaks = breakpoints(knots)
    new = {t for a, b in zip(breaks[:-1], breaks[1:], strict=True) for t in np.linspace(a, b, parts + 1)[1:-1]}
    while 0.0 < layer < breaks[1] / parts:
        new |= {layer, 1.0 - layer}
        layer *= 2.0
    return np.sort(np.concatenate([knots, [t for t in new if np.abs(breaks - t).min() > 1e-9]]))


def true_error(volume, coarse, problem, parts, layers):
    """Return the L2 error of a solution against one on much finer knots."""
    knots = [finer(*each) for each in zip(volume.knots, parts, layers, strict=True)]
    fine = solve_problem(volume.on_knots(knots), problem, estimate=False)
    (u, w_u), (v, w_v), (w, w_w) = ([part.ravel() for part in gauss_points(row, 3)] for row in knots)
    squares = (coarse.grid(u, v, w) - fine.grid(u, v, w)) ** 2
    squares = squares.sum(axis=-1) if squares.ndim == 4 else squares
    return np.sqrt(
        np.einsum("ijk,ijk,i,j,k", squares, np.abs(np.linalg.det(volume.grid_jacobian(u, v, w))), w_u, w_v, w_w)
    )


LOAD = Poisson(source="1")
FREE_ENDS = Poisson(source="1", neumann={"u0": "0", "u1": "0"})
FREE_SIDES = Poisson(source="1", neumann=dict.fromkeys(("u0", "u1", "v0", "v1"), "0"))
FORCE = Elasticity(body_force=("1", "1", "1"))


class Wind(Form):
    symmetric = False

    def flux(self, u, grad, x):
        return 0.1 * grad

    def react(self, u, grad, x):
        return grad[:, 0]


def wavy(u, v, w):
    return 2.0 * u + 0.3 * np.sin(3.0 * v), v + 0.2 * np.sin(2.0 * u) * w, w + 0.2 * u * v


def cone(u, v, w):
    return 15.0 * u, (1.0 - 0.9 * u) * (v - 0.5), (1.0 - 0.9 * u) * (w - 0.5)


BODIES = {  # volume, problem, parts of a span and the thinnest layer of the finer knots
    "rod 20": (box((20, 1, 1), (4, 8, 8)), LOAD, (6, 2, 2), (5e-3, 0, 0)),
    "rod 100": (box((100, 1, 1), (4, 8, 8)), LOAD, (6, 2, 2), (1e-3, 0, 0)),
    "rod 1000": (box((1000, 1, 1), (4, 8, 8)), LOAD, (6, 2, 2), (1e-4, 0, 0)),
    "rod 100, ends insulated": (box((100, 1, 1), (4, 8, 8)), FREE_ENDS, (1, 4, 4), (0, 0, 0)),
    "rod 50": (box((50, 1, 1), (2, 10, 10)), LOAD, (6, 2, 2), (2e-3, 0, 0)),
    "plate, sides insulated": (box((20, 20, 1), (4, 4, 4)), FREE_SIDES, (2, 2, 3), (0, 0, 0)),
    "plate": (box((20, 20, 1), (4, 4, 4)), LOAD, (4, 4, 3), (5e-3, 5e-3, 0)),
    "box 5": (box((5, 1, 1), (2, 2, 2)), LOAD, (5, 4, 4), (2e-2, 2e-2, 2e-2)),
    "elastic rod": (box((20, 1, 1), (4, 4, 4)), FORCE, (4, 2, 2), (5e-3, 0, 0)),
    "uneven knots": (on_knots(((0.01, 0.5, 0.97), (0.1, 0.11), (0.4, 0.9)), wavy), LOAD, (4, 6, 6), (0, 0.02, 0.02)),
    "one span": (box((5, 1, 1), (1, 1, 1)), LOAD, (8, 8, 8), (2e-2, 2e-2, 2e-2)),
    "degree 2": (box((20, 1, 1), (4, 8, 8), 2), LOAD, (6, 2, 2), (5e-3, 0, 0)),
    "degree 4": (box((20, 1, 1), (4, 5, 5), 4), LOAD, (6, 2, 2), (5e-3, 0, 0)),
    "cone": (on_knots(((0.25, 0.5, 0.75), (0.3, 0.6), (0.3, 0.6)), cone), LOAD, (5, 4, 4), (5e-3, 0, 0)),
    "ring": (bent(0.7, shape=(7, 6, 6)), FREE_ENDS, (5, 4, 4), (0, 0, 0)),
    "reaction": (box((20, 1, 1), (4, 5, 5)), Poisson(source="1", reaction="100"), (6, 3, 3), (2e-3, 1e-2, 1e-2)),
    "conductivity": (box((20, 1, 1), (4, 5, 5)), Poisson(source="1", kappa="1+x*x/10+y"), (6, 3, 3), (2e-3, 0, 0)),
    "tensor": (box((1, 1, 1), (5, 5, 5)), Poisson(source="1", kappa=(1, 0, 0, 100, 0, 100)), (5, 3, 3), (1e-2, 0, 0)),
    "wind": (box((5, 1, 1), (6, 5, 5)), Problem(Wind(), source="1"), (4, 3, 3), (2e-3, 0, 0)),
    "cooled rod": (
        box((100, 1, 1), (4, 5, 5)),
        Poisson(source="1", robin=dict.fromkeys(("v0", "v1", "w0", "w1"), ("1000", "0"))),
        (6, 3, 3),
        (1e-3, 0, 0),
    ),
    "values that are not resolved": (
        box((20, 1, 1), (5, 5, 5)),
        Poisson(source="0", boundary="sin(x)*exp(y)*z"),
        (6, 3, 3),
        (0, 0, 0),
    ),
    "cube with singular edges": (benchmark_volume(4), LOAD, (4, 4, 4), (0, 0, 0)),
}


@pytest.mark.parametrize("name", BODIES)
def test_estimate_is_near_the_true_error_of_a_stretched_body(name):
    """Within a factor of 5; it was up to 100 000 times too large, as the longest extent alone decided."""
    volume, problem, parts, layers = BODIES[name]
    coarse = solve_problem(volume, problem, estimate=True)
    assert 0.5 < coarse.report.error_estimate / true_error(volume, coarse, problem, parts, layers) < 5.0


@pytest.mark.parametrize(("spans", "length"), [((4, 2, 2), 20.0), ((8, 2, 2), 20.0), ((8, 2, 2), 60.0)])
def test_a_beam_that_is_too_stiff_is_noticed(spans, length):
    """Bent by a force at its end a beam 1 x 1 sinks by 4 F l^3 / E; a coarse mesh misses a share of that."""
    free = dict.fromkeys(("v0", "v1", "w0", "w1"), ("0", "0", "0"))
    pulled = Elasticity(body_force=("0", "0", "0"), traction={**free, "u1": ("0", "0", "1")})
    found = solve_problem(box((length, 1, 1), spans), pulled, tolerance=1e-12)
    missing = 1.0 - found([[1.0, 0.5, 0.5]])[0, 2] / (4.0 * length**3)
    assert missing > 0.02 and 0.3 < found.report.error_estimate_relative / missing < 5.0


def test_what_the_space_holds_has_no_error():
    """z (1 - z) / 2 is a parabola, and so are its values on a face in the plate's own space."""
    points = greville(open_uniform_knots(7, 3), 3)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    plate = BSplineVolume.uniform(grid * [20.0, 20.0, 1.0])
    assert solve_problem(plate, FREE_SIDES).report.error_estimate_relative < 1e-8


def test_lowest_waves_by_hand():
    """cos(k t) with k tan(k / 2) = b / 2 ... : k = 2 arctan(b / k) for two equal ends of a bar of length 2, kappa 3."""
    bar = box((2, 1, 1), (2, 2, 2), 1)
    problem = Poisson(
        source="1", kappa="3", robin={"u0": ("6", "0"), "u1": ("6", "0")}, neumann={"v1": "0", "w0": "0", "w1": "0"}
    )
    k, half, none = lowest_waves(bar, problem)
    assert k * np.tan(k / 2.0) == pytest.approx(6.0 * 2.0 / 3.0) and 0.0 < k < np.pi
    assert half == pytest.approx(np.pi / 2.0) and none == 0.0
    assert lowest_waves(bar, Poisson(source="1")) == pytest.approx([np.pi] * 3)
