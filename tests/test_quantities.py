"""Quantities, extremes and integrals of solutions, against values known by hand."""

import numpy as np
import pytest

import iga_nn
from iga_nn.report.extremes import peak_notices
from iga_nn.workflow.solving import level_of
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume, integrate, resultant
from solve.forms.stresses import outer_principal, principal, von_mises

YOUNG, NU = 210.0, 0.3
TENSION = ("x", f"-{NU}*y", f"-{NU}*z")  # a bar in tension of stress YOUNG along x


@pytest.fixture(scope="module")
def heat():
    return iga_nn.solve(benchmark_volume(4), iga_nn.Poisson(exact="exp(x)*sin(y)+z*z", kappa="1+x*x"), refine=1)


@pytest.fixture(scope="module")
def bar():
    traction = dict.fromkeys(("u1", "v0", "v1", "w0", "w1"))
    problem = iga_nn.Elasticity(exact=TENSION, young=YOUNG, poisson_ratio=NU, traction=traction)
    block = BSplineVolume.from_function(lambda u, v, w: (2.0 * u, v + 0.5 * u, w), 6)
    return iga_nn.solve(block, problem)


@pytest.fixture(scope="module")
def shell():
    """A quarter of a hollow cylinder, radii 1 and 2, height 3: not exactly so, for splines are no circles."""

    def quarter(u, v, w):
        return (1.0 + u) * np.cos(v * np.pi / 2), (1.0 + u) * np.sin(v * np.pi / 2), 3.0 * w

    return BSplineVolume.from_function(quarter, 12)


def test_gradient_and_flux(heat):
    places = np.random.default_rng(0).random((50, 3))
    x, y, z = heat.geometry(places).T
    slopes = np.stack([np.exp(x) * np.sin(y), np.exp(x) * np.cos(y), 2.0 * z], axis=-1)
    np.testing.assert_allclose(heat.quantity("gradient", places)[:, 0], slopes, atol=2e-3)
    np.testing.assert_allclose(heat.quantity("flux", places)[:, 0], (1.0 + x**2)[:, None] * slopes, atol=4e-3)
    np.testing.assert_allclose(heat.quantity("u", places)[:, 0], heat(places), atol=1e-14)


def test_stress_of_a_bar_in_tension(bar):
    places = np.random.default_rng(1).random((50, 3))
    stress = np.zeros((50, 3, 3))
    stress[:, 0, 0] = YOUNG
    np.testing.assert_allclose(bar.quantity("stress", places), stress, atol=1e-8 * YOUNG)
    np.testing.assert_allclose(bar.quantity("strain", places)[:, 1, 1], -NU, atol=1e-7)
    np.testing.assert_allclose(bar.quantity("von_mises", places), YOUNG, rtol=1e-7)
    np.testing.assert_allclose(bar.quantity("principal", places)[:, 0], YOUNG, rtol=1e-7)
    x, y, z = bar.geometry(places).T
    np.testing.assert_allclose(bar.quantity("magnitude", places), np.sqrt(x**2 + NU**2 * (y**2 + z**2)), atol=1e-7)


def test_stresses_by_hand():
    shear = np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert von_mises(shear) == pytest.approx(2.0 * 3.0**0.5)
    np.testing.assert_allclose(principal(shear), [2.0, 0.0, -2.0], atol=1e-14)
    pressure = -5.0 * np.eye(3)
    assert von_mises(pressure) == pytest.approx(0.0, abs=1e-14)
    assert von_mises(shear + pressure) == pytest.approx(2.0 * 3.0**0.5)


def test_grids_and_points_agree(heat):
    rows = [0.0, 0.3, 1.0], [0.1, 0.9], [0.5]
    grid = heat.quantity_grid("flux", *rows)
    assert grid.shape == (3, 2, 1, 1, 3)
    places = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(grid.reshape(-1, 1, 3), heat.quantity("flux", places), atol=1e-12)


def test_points_in_space_and_outside(heat):
    points = np.append(heat.geometry([[0.2, 0.5, 0.7]]), [[99.0, 0.0, 0.0]], axis=0)
    flux = heat.quantity("flux", heat.geometry.locate(points))
    np.testing.assert_allclose(flux[:1], heat.quantity("flux", [[0.2, 0.5, 0.7]]), atol=1e-10)
    assert np.isnan(flux[1]).all()


def test_a_coefficient_that_is_a_field_is_known_at_any_points(heat):
    kappa = iga_nn.SplineField(heat.degrees, heat.knots, np.full_like(heat.coefficients, 3.0), heat.geometry)
    problem = iga_nn.Poisson(source="1", boundary="0", kappa=kappa)
    solution = iga_nn.solve(heat.geometry, problem)
    places = [[0.2, 0.3, 0.4], [0.5, 0.6, 0.7]]
    np.testing.assert_allclose(solution.quantity("flux", places), 3.0 * solution.quantity("gradient", places))


def test_functions_of_ones_own(heat):
    places = np.random.default_rng(2).random((20, 3))
    energy = heat.quantity(lambda u, grad, x: 0.5 * (1 + x[0] ** 2) * (grad[0] ** 2).sum(axis=0), places)
    flux, grad = heat.quantity("flux", places), heat.quantity("gradient", places)
    np.testing.assert_allclose(energy, 0.5 * (flux * grad).sum(axis=(1, 2)), rtol=1e-12)


@pytest.mark.parametrize("refine", [0, 2])
def test_extremes_have_their_place(refine):
    cube = BSplineVolume.from_function(lambda u, v, w: (2.0 * u, v, w), 4)
    solution = iga_nn.solve(cube, iga_nn.Poisson(exact="x*(2-x)*y*(1-y)+z"), refine=refine)
    found = solution.extremes(lambda u, grad, x: u[0] - x[2])
    assert found.largest == pytest.approx(0.25, abs=1e-7)
    np.testing.assert_allclose(found.largest_at, [1.0, 0.5, found.largest_at[2]], atol=1e-3)
    np.testing.assert_allclose(found.largest_parameters[:2], [0.5, 0.5], atol=1e-3)
    slope = solution.extremes(lambda u, grad, x: grad[0, 0])  # 2 (1 - x) y (1 - y): at the ends of the body
    assert (slope.least, slope.largest) == (pytest.approx(-0.5, abs=1e-6), pytest.approx(0.5, abs=1e-6))
    np.testing.assert_allclose(slope.least_at[:2], [2.0, 0.5], atol=1e-3)
    assert "to 0.25 at (1, 0.5" in str(found)


def test_extremes_are_of_one_finite_number(heat):
    assert heat.extremes("u").largest == heat.extremes(lambda u, grad, x: u[0]).largest
    with pytest.raises(ValueError, match=r"one number a point, this quantity has the shape \(1, 3\): choose a part"):
        heat.extremes("flux")
    with pytest.raises(ValueError, match="finite numbers"):
        heat.extremes(lambda u, grad, x: np.nan * u[0])


def test_volume_and_area_are_exact():
    box = BSplineVolume.from_function(lambda u, v, w: (2.0 * u, 3.0 * v, 0.5 * w), 5)
    assert integrate(box) == pytest.approx(3.0, rel=1e-14)
    assert integrate(box, over="u1") == pytest.approx(1.5, rel=1e-14)
    assert integrate(box, over=["v0", "v1", "v0"]) == pytest.approx(2.0, rel=1e-14)
    assert integrate(box, lambda x: x[0] * x[1]) == pytest.approx(2.0 * 4.5 * 0.5, rel=1e-13)
    np.testing.assert_allclose(integrate(box, lambda x: x, over="w1"), [6.0, 9.0, 3.0], rtol=1e-13)


def test_numbers_are_functions_too(heat):
    volume = heat.geometry
    assert integrate(volume, lambda x: 2.0) == pytest.approx(2.0 * integrate(volume), rel=1e-14)
    assert integrate(heat, lambda u, grad, x: 2.0, over="u1") == pytest.approx(2.0 * integrate(volume, over="u1"))


def test_what_is_no_body_is_refused(heat):
    with pytest.raises(TypeError, match="body must be a volume or a solution, got 'map.npz'"):
        integrate("map.npz")
    with pytest.raises(TypeError, match="a resultant is that of a solution"):
        resultant(heat.geometry, "u1")


def test_a_hollow_cylinder(shell):
    assert integrate(shell) == pytest.approx(0.25 * np.pi * 3.0 * 3.0, rel=1e-5)
    assert integrate(shell, over="u1") == pytest.approx(np.pi * 3.0, rel=1e-5)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_divergence_theorem(mirrored):
    volume = benchmark_volume(4)
    if mirrored:
        volume = BSplineVolume(volume.degrees, volume.knots, volume.control_points[..., [1, 0, 2]])
    solution = iga_nn.solve(volume, iga_nn.Poisson(exact="x"))
    assert integrate(solution, "u")[0] == pytest.approx(integrate(volume, lambda x: x[0]), rel=1e-8)
    faces = ("u0", "u1", "v0", "v1", "w0", "w1")
    total = resultant(solution, faces)  # of the gradient of x, whose divergence is zero
    assert abs(total[0]) < 1e-8
    bent = iga_nn.solve(volume, iga_nn.Poisson(exact="x*x"), refine=1)
    assert resultant(bent, faces)[0] == pytest.approx(2.0 * integrate(volume), rel=1e-4)


def test_the_force_on_a_bar(bar):
    pulled = resultant(bar, "u1") + resultant(bar, "u0")
    sides = resultant(bar, ["v0", "v1", "w0", "w1"])
    np.testing.assert_allclose(pulled + sides, 0.0, atol=1e-6 * YOUNG)
    np.testing.assert_allclose(resultant(bar, "u1"), [YOUNG, 0.0, 0.0], atol=1e-6 * YOUNG)  # of area 1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.quantity("stress", [[0.5, 0.5, 0.5]]), "Poisson gives no 'stress'; it gives u, gradient, flux"),
        (lambda s: s.quantity(lambda u, grad, x: u[7], [[0.5, 0.5, 0.5]]), "the quantity fails: IndexError"),
        (lambda s: s.quantity(lambda u, grad, x: np.ones(7), [[0.5] * 3]), r"must return an array \(..., 1\), got"),
        (lambda s: s.quantity("u", np.zeros((1, 4, 3))), r"points must have shape \(m, 3\), got \(1, 4, 3\)"),
        (lambda s: s.quantity("u", [[1j, 0.0, 0.0]]), "points must be real numbers"),
        (lambda s: integrate(s, over="top"), "region 'top'"),
        (lambda s: integrate(s, over=[]), "over: give regions"),
        (lambda s: integrate(s, over=3), "over: give regions"),
        (lambda s: resultant(s, None), "over: give regions"),
        (lambda s: integrate(s.geometry, "u"), "a volume alone has no 'u'"),
        (lambda s: integrate(s.geometry, 3), "what must be a function or nothing, got 3"),
        (lambda s: integrate(s.geometry, lambda x: np.ones(7)), "must return an array"),
        (lambda s: integrate(s.geometry, lambda u, grad, x: u), "the function of x fails: TypeError"),
    ],
)
def test_bad_questions_are_refused(heat, call, message):
    with pytest.raises(ValueError, match=message):
        call(heat)


def test_all_extremes_are_those_found_alone(bar, heat):
    found = heat.all_extremes()
    assert list(found) == ["u", "gradient_magnitude", "flux_magnitude"]
    for name, extremes in found.items():
        alone = heat.extremes(name)
        assert extremes.largest == pytest.approx(alone.largest, rel=1e-6)
        np.testing.assert_allclose(extremes.largest_at, alone.largest_at, atol=1e-3)
    assert list(bar.all_extremes()) == ["magnitude", "von_mises", "first_principal", "third_principal"]
    assert bar.all_extremes()["magnitude"].largest_at[0] == pytest.approx(2.0)
    assert list(iga_nn.solve(heat.geometry, iga_nn.Poisson()).all_extremes()) == ["u", "gradient_magnitude"]


def test_outer_principal_stresses_are_those_of_the_eigenvalues():
    tensors = np.random.default_rng(5).standard_normal((3, 3, 200))
    tensors += np.swapaxes(tensors, 0, 1)
    tensors[..., 0], tensors[..., 1] = 0.0, 3.0 * np.eye(3)
    tensors[..., 2], tensors[..., 3] = np.diag([1.0, 1.0, 4.0]), np.diag([4.0, 4.0, -1.0])
    largest, _, smallest = principal(tensors)
    np.testing.assert_allclose(outer_principal(tensors), [largest, smallest], atol=1e-7)


def test_the_stress_at_a_clamped_rim_grows_and_a_smooth_one_does_not():
    zero, free = ("0", "0", "0"), ("v0", "v1", "w0", "w1")
    beam = BSplineVolume.from_function(lambda u, v, w: (4.0 * u, v, w), 5)
    bent = iga_nn.Elasticity(displacement=zero, traction={**dict.fromkeys(free, zero), "u1": ("0", "0", "-1")})
    smooth = iga_nn.Elasticity(exact=("sin(x)*y", "cos(y)*z", "x*z"), traction=dict.fromkeys(free))
    for problem, grows in ((bent, True), (smooth, False)):
        levels = [level_of(iga_nn.solve(beam, problem, refine=refine)) for refine in (0, 1)]
        notices = peak_notices({"levels": levels})
        assert len(notices) == grows and all("infinite at the rim of the displacement" in notice for notice in notices)
    assert levels[1]["seconds"]["extremes"] < sum(levels[1]["seconds"].values())
