"""Nearly incompressible bodies: displacement and pressure together."""

from dataclasses import replace

import numpy as np
import pytest

import iga_nn
from solve import benchmark_volume
from solve.discretization.pressure import extraction
from solve.discretization.space import trial_space
from solve.field import BodyField
from solve.linear.saddle import Saddle, saddle_point
from solve.mixed import is_mixed
from solve.options import SolveOptions
from solve.patch_system import PatchProblem

OTHERS = ("u1", "v0", "v1", "w0", "w1")
NEARLY = 0.4999


def first_of_lame(ratio, young=1.0):
    return young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))


def bent(i, j, k, counts, control_points, degree):
    """A patch of a bent block of 2 x 1 x 1."""

    def place(u, v, w):
        x, y, z = 2.0 * (i + u) / counts[0], (j + v) / counts[1], (k + w) / counts[2]
        return x + 0.15 * np.sin(2 * y) * z, y + 0.15 * np.sin(1.5 * x + z), z + 0.15 * np.sin(x) * np.cos(y)

    return iga_nn.BSplineVolume.from_function(place, control_points, degree)


def block(counts, control_points, degree):
    places = np.ndindex(*counts)
    return iga_nn.Body.from_patches([bent(*place, counts, control_points, degree) for place in places])


def sphere(counts, control_points, degree):
    """A 24th of a thick sphere of radii 1 and 2, in patches."""

    def patch(i, j, k):
        def place(u, v, w):
            s, t = (np.tan((n + a) / counts[1] * np.pi / 4) for n, a in ((j, v), (k, w)))
            size = (1.0 + (i + u) / counts[0]) / np.sqrt(1.0 + s * s + t * t)
            return size * s, size * t, size

        return iga_nn.BSplineVolume.from_function(place, control_points, degree)

    places = np.ndindex(counts[0], counts[1], counts[1])
    return iga_nn.Body.from_patches([patch(*place) for place in places])


KNOTS = [
    ([], 2),
    ([0.3], 2),
    ([0.2, 0.5], 3),
    ([0.1, 0.3, 0.4, 0.6, 0.7], 2),
    ([0.1, 0.2, 0.5, 0.5, 0.5, 0.6], 3),
    ([0.1, 0.2, 0.5, 0.5, 0.6, 0.8], 3),
]


@pytest.mark.parametrize(("inner", "degree"), KNOTS)
def test_pressures_are_the_same_from_both_ends(inner, degree):
    knots = np.array([0.0] * (degree + 1) + inner + [1.0] * (degree + 1))
    found = extraction(knots, degree)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-14)
    assert found.min() >= 0.0 and np.linalg.matrix_rank(found) == found.shape[1] < found.shape[0]
    np.testing.assert_allclose(extraction(1.0 - knots[::-1], degree), found[::-1, ::-1], atol=1e-14)


def infsup(body, held):
    """The least eigenvalue of B K^-1 B^T, over that of the pressures' mass over 2 mu."""
    law = iga_nn.Elasticity(fix=held, body_force=(0, 0, -1), poisson_ratio=0.4999999)
    matrix = iga_nn.discretize(body, law).operator
    whole = matrix @ np.eye(matrix.shape[0])
    n = iga_nn.discretize(body, law, formulation="displacement").load.size
    stiffness, coupling = whole[:n, :n], whole[n:, :n]
    (first, shear), mass = law.constants, -whole[n:, n:]
    schur = coupling @ np.linalg.solve(stiffness, coupling.T)
    return np.linalg.eigvals(np.linalg.solve(first / (2.0 * shear) * mass, schur)).real.min()


@pytest.mark.parametrize(
    ("body", "held"),
    [
        (iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), 6, 2), "u0"),
        (block((2, 1, 1), 3, 2), "p0_u0"),  # a span each
        (block((2, 1, 1), 4, 2), "p0_u0"),  # two spans
    ],
)
def test_displacements_control_every_pressure(body, held):
    assert infsup(body, held) > 0.2  # of pressures of degree 1 on each span it falls with every refinement


LINEAR = "0.1*x+0.2*y-0.3*z+x/{0}", "0.2*y-0.1*x", "-0.3*z+0.2*x+0.1*y"  # with a pressure of -1


@pytest.mark.parametrize("ratio", [0.49, NEARLY, 0.499999])
@pytest.mark.parametrize(
    ("body", "held"),
    [
        (
            iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u + v * w, v - 0.2 * u * w, w + 0.3 * u * v), 6),
            "u0",
        ),
        (block((2, 2, 1), 3, 2), "x < 0.2 and nx < -0.8"),
    ],
)
def test_a_linear_field_is_met_exactly(body, held, ratio):
    exact = tuple(text.format(first_of_lame(ratio)) for text in LINEAR)
    problem = iga_nn.Elasticity(exact=exact, poisson_ratio=ratio, conditions=[iga_nn.Fix(held, exact)])
    solution = iga_nn.solve(body, problem, tolerance=1e-12)
    assert solution.report.l2_relative < 1e-8 and solution.report.balance.imbalance < 1e-10
    pressures = np.concatenate([patch.pressure.ravel() for patch in solution.patches])
    np.testing.assert_allclose(pressures, -1.0, atol=1e-7)


def test_orders_of_convergence():
    first = first_of_lame(NEARLY)
    exact = f"0.3*sin(y)*cos(z)+cos(2*x+y)/{first!r}", "0.3*sin(z+x)", "0.3*cos(x)*sin(y)"
    problem = iga_nn.Elasticity(exact=exact, poisson_ratio=NEARLY, traction=dict.fromkeys(OTHERS))
    errors = [iga_nn.solve(benchmark_volume(2), problem, refine=refine).report.l2_relative for refine in (1, 2)]
    assert errors[0] / errors[1] > 2**2.9


@pytest.mark.parametrize("body", [sphere((2, 1), 5, 2), sphere((3, 1), 4, 3)])
def test_a_thick_sphere_does_not_lock(body):
    """Lame: radii 1 and 2 under inner pressure; the pressure inside is the same everywhere."""
    push, young = 10.0, 200.0
    conditions = {"symmetry": "abs(nx*x + ny*y + nz*z) < 0.5", "pressure": {"nx*x + ny*y + nz*z < -0.5": push}}
    counts = {}
    for ratio in (0.3, NEARLY):
        law = iga_nn.Elasticity(young=young, poisson_ratio=ratio, **conditions)
        solution = iga_nn.solve(body, law, tolerance=1e-8, estimate=False)
        counts[ratio] = solution.report.iterations
    assert counts[NEARLY] <= 1.5 * counts[0.3]
    along = np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0])
    radius = np.linspace(1.02, 1.98, 30)
    moved = solution.probe(radius[:, None] * along) @ along
    expected = push * radius / (7 * young) * ((1 - 2 * NEARLY) + (1 + NEARLY) * 4 / radius**3)
    np.testing.assert_allclose(moved, expected, rtol=2e-2)
    stress = solution.quantity("stress", radius[:, None] * along)
    radial = np.einsum("mij,i,j->m", stress, along, along)
    np.testing.assert_allclose(radial, push / 7 * (1 - 8 / radius**3), atol=0.1 * push)
    pressure = solution.quantity("pressure", radius[:, None] * along)
    np.testing.assert_allclose(pressure, -push / 7, atol=0.02 * push)  # without the mixed form it swings by 40 push


def cook(n):
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (48 * u, 44 * u + v * (44 - 28 * u), 10 * w), n + 2, 2)


def test_cooks_membrane_does_not_lock():
    def tip(n):
        law = iga_nn.Elasticity(
            young=240.565, poisson_ratio=NEARLY, fix="u0", load={"u1": ("0", "6.25/10", "0")}, body_force=(0, 0, 0)
        )
        return iga_nn.solve(cook(n), law, estimate=False)([[1.0, 1.0, 0.5]])[0, 1]

    coarse, fine = tip(3), tip(6)
    assert coarse == pytest.approx(fine, rel=0.05)


def test_materials_meet():
    """A soft body between two stiff ones: the pressure jumps where the material does."""
    bar = iga_nn.Body.from_patches(
        [iga_nn.BSplineVolume.from_function(lambda u, v, w, i=i: (i + u, v, w), 4) for i in range(3)]
    )
    law = iga_nn.Elasticity(
        young={0: 1.0, 1: 5.0, 2: 1.0}, poisson_ratio={0: 0.49, 1: 0.3, 2: 0.49}, fix="p0_u0", load={"p2_u1": (1, 0, 0)}
    )
    solution = iga_nn.solve(bar, law, refine=1, estimate=False)
    assert solution.report.formulation == "mixed" and solution.report.balance.imbalance < 1e-8
    stress = solution.quantity("stress", [[x, 0.5, 0.5] for x in (0.95, 1.05, 1.95, 2.05)])
    np.testing.assert_allclose(stress[:, 0, 0], 1.0, atol=0.1)
    left, right = solution.quantity("pressure", [[0.999, 0.5, 0.5], [1.001, 0.5, 0.5]])
    assert abs(left - right) > 0.05


def test_a_file_keeps_the_pressure(tmp_path):
    law = iga_nn.Elasticity(poisson_ratio=NEARLY, fix="u0", load={"u1": (1, 0, 0)})
    solution = iga_nn.solve(benchmark_volume(2), law)
    assert "formulation" in solution.report.as_dict()
    solution.save(tmp_path / "solution.npz")
    (loaded,) = BodyField.load(tmp_path / "solution.npz").patches
    np.testing.assert_array_equal(loaded.pressure, solution.patches[0].pressure)
    body = block((2, 1, 1), 3, 2)
    several = iga_nn.solve(body, iga_nn.Elasticity(poisson_ratio=NEARLY, fix="p0_u0", load={"p1_u1": (1, 0, 0)}))
    several.save(tmp_path / "several.npz")
    for own, patch in zip(BodyField.load(tmp_path / "several.npz").patches, several.patches, strict=True):
        np.testing.assert_array_equal(own.pressure, patch.pressure)
    with pytest.raises(ValueError, match="pressure must have the shape"):
        replace(loaded, pressure=loaded.pressure[1:])


@pytest.mark.parametrize(
    ("problem", "degree", "said"),
    [
        (iga_nn.Poisson(exact="x"), 2, "Poisson has no pressure"),
        (iga_nn.Elasticity(exact=("x", "y", "z"), poisson_ratio=0.0), 2, "must be positive"),
        (iga_nn.Elasticity(exact=("x", "y", "z"), poisson_ratio=NEARLY), 1, "degree must be at least 2"),
    ],
)
def test_without_a_mixed_form(problem, degree, said):
    volume = benchmark_volume(2)
    patches = [PatchProblem(volume, problem, trial_space(volume, degree=degree))]
    assert not is_mixed(problem, patches, SolveOptions())
    with pytest.raises(ValueError, match=said):
        is_mixed(problem, patches, SolveOptions(formulation="mixed"))


def test_a_formulation_is_one_of_two():
    with pytest.raises(ValueError, match="formulation must be one of mixed, displacement"):
        iga_nn.solve(benchmark_volume(2), iga_nn.Elasticity(exact=("x", "y", "z")), formulation="other")


def test_a_user_solves_the_system():
    from scipy.sparse.linalg import minres

    system = iga_nn.discretize(
        benchmark_volume(2), iga_nn.Elasticity(poisson_ratio=NEARLY, fix="u0", load={"u1": (1, 0, 0)})
    )
    x, failed = minres(system.operator, system.load, M=system.preconditioner, rtol=1e-12, maxiter=2000)
    assert failed == 0
    own = system.solve(tolerance=1e-12)
    np.testing.assert_allclose(system.field(x).coefficients, own.coefficients, atol=1e-6)


def test_an_iteration_that_breaks_down_starts_again():
    rng = np.random.default_rng(0)
    stiffness = np.diag(np.geomspace(1e-3, 1.0, 40))
    coupling = rng.standard_normal((10, 40))
    right = rng.standard_normal(40), rng.standard_normal(10)
    system = Saddle(
        lambda u: (stiffness @ u, coupling @ u),
        lambda p: (coupling.T @ p, -1e-3 * p),
        lambda r: r * np.where(np.arange(40) % 2, 30.0, 1.0),
        lambda r: r,
    )
    found = saddle_point(system, right, 1e-9, 5000)
    assert found.converged
    u, p = found.x
    np.testing.assert_allclose(stiffness @ u + coupling.T @ p, right[0], atol=1e-6)
    np.testing.assert_allclose(coupling @ u - 1e-3 * p, right[1], atol=1e-6)
    assert not saddle_point(system, right, 1e-9, 3).converged
    nothing = saddle_point(system, (0 * right[0], 0 * right[1]), 1e-9, 10)
    assert nothing.converged and nothing.iterations == 0
