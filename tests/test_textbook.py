"""Cases of textbooks, data on regions only: each number is known by hand or from a closed formula."""

from dataclasses import replace

import numpy as np
import pytest

import iga_nn

PLANES = ["nx < -0.99", "ny < -0.99", "nz < -0.99"]
EXACTLY = {"tolerance": 1e-13, "estimate": False}


def block(length, control_points, side=1.0):
    """A square bar along x, its axis at y = z = 0."""
    return iga_nn.BSplineVolume.from_function(
        lambda u, v, w: (length * u, side * (v - 0.5), side * (w - 0.5)), control_points
    )


def places(count=200):
    """Parameters of random points, half of them on the faces u = 0 and u = 1."""
    found = np.random.default_rng(0).random((count, 3))
    found[: count // 4, 0], found[count // 4 : count // 2, 0] = 0.0, 1.0
    return found


def along(stress, direction):
    """The normal stress (m,) across planes with unit normals (m, 3)."""
    return np.einsum("mi,mij,mj->m", direction, stress, direction)


TENSION = [
    {"roller": PLANES, "load": {"nx > 0.99": (2, 0, 0)}},
    {"symmetry": PLANES, "pressure": {"nx > 0.99": -2}},
    {
        "roller": {"nx < -0.99": 0},
        "fix": {"ny < -0.99": (None, 0, None), "nz < -0.99": [None, None, 0]},
        "load": {"nx > 0.99": ("2", "0", "0")},
    },
]


@pytest.mark.parametrize("conditions", TENSION)
def test_a_bar_in_tension(conditions):
    bar = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), 5)
    solution = iga_nn.solve(bar, iga_nn.Elasticity(young=10.0, poisson_ratio=0.3, **conditions), **EXACTLY)
    where = places()
    stress = np.zeros((3, 3))
    stress[0, 0] = 2.0
    np.testing.assert_allclose(solution(where), bar(where) * [0.2, -0.06, -0.06], atol=1e-10)  # tip: 0.8
    np.testing.assert_allclose(solution.quantity("stress", where), stress[None].repeat(len(where), axis=0), atol=1e-10)
    reactions = solution.report.balance.reactions
    for role, force in reactions.items():
        np.testing.assert_allclose(force, [-2.0 if "nx" in role else 0.0, 0.0, 0.0], atol=1e-10)
    np.testing.assert_allclose(iga_nn.resultant(solution, "nx > 0.99"), [2.0, 0.0, 0.0], atol=1e-10)


def test_a_bar_on_a_spring():
    bar = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), 5)
    conditions = {"roller": PLANES[1:], "spring": {"nx < -0.99": 5.0}, "load": {"nx > 0.99": (2, 0, 0)}}
    solution = iga_nn.solve(bar, iga_nn.Elasticity(young=10.0, poisson_ratio=0.0, **conditions), **EXACTLY)
    where = places()
    expected = np.zeros((len(where), 3))
    expected[:, 0] = 2.0 / 5.0 + 0.2 * bar(where)[:, 0]  # the spring gives way by load / k, the bar stretches by 2 / E
    np.testing.assert_allclose(solution(where), expected, atol=1e-10)
    np.testing.assert_allclose(solution.report.balance.reactions["spring 'nx < -0.99'"], [-2.0, 0.0, 0.0], atol=1e-10)


@pytest.mark.parametrize("ratio", [0.0, 0.3])
def test_a_cantilever(ratio):
    length, force, young = 20.0, 0.1, 1000.0
    conditions = {"fix": "nx < -0.99", "load": {"nx > 0.99": (0, 0, -force)}}  # on an area of 1
    law = iga_nn.Elasticity(young=young, poisson_ratio=ratio, **conditions)
    solution = iga_nn.solve(block(length, (20, 5, 5)), law, estimate=False)
    shear_factor = 10.0 * (1.0 + ratio) / (12.0 + 11.0 * ratio)  # Cowper 1966, of a rectangle
    shear = young / (2.0 * (1.0 + ratio))
    timoshenko = force * length**3 / (3.0 * young / 12.0) + force * length / (shear_factor * shear)
    assert -solution.probe([[length, 0.0, 0.0]])[0, 2] == pytest.approx(timoshenko, rel=1e-2)
    stress = solution.quantity("stress", [[0.5, v, w] for v in (0.0, 0.5, 1.0) for w in (0.0, 1.0)])
    fibre = 6.0 * force * length / 2.0  # 6 M / (b h^2), compressed below
    np.testing.assert_allclose(stress[:, 0, 0], [-fibre, fibre] * 3, rtol=1e-2)
    np.testing.assert_allclose(solution.report.balance.reactions["fix 'nx < -0.99'"], [0.0, 0.0, force], atol=1e-9)


def test_a_thick_cylinder():
    """Lame: radii 1 and 2 under inner pressure, a quarter between planes of symmetry."""
    pressure, ratio = 10.0, 0.3

    def quarter(u, v, w):
        return (1.0 + u) * np.cos(v * np.pi / 2), (1.0 + u) * np.sin(v * np.pi / 2), 0.5 * w

    body = iga_nn.BSplineVolume.from_function(quarter, (14, 12, 4))
    conditions = {"symmetry": ["x < 1e-9", "y < 1e-9", "abs(nz) > 0.99"], "pressure": {"nx*x + ny*y < -0.5": pressure}}
    solution = iga_nn.solve(body, iga_nn.Elasticity(young=200.0, poisson_ratio=ratio, **conditions), estimate=False)
    where = places()
    x, y, _ = body(where).T
    radius, zero = np.hypot(x, y), 0.0 * x
    stress = solution.quantity("stress", where)
    mean = pressure / 3.0  # p a^2 / (b^2 - a^2)
    hoop = along(stress, np.stack([-y / radius, x / radius, zero], axis=1))
    radial = along(stress, np.stack([x / radius, y / radius, zero], axis=1))
    np.testing.assert_allclose(hoop, mean * (1.0 + 4.0 / radius**2), rtol=1e-3)
    np.testing.assert_allclose(radial, mean * (1.0 - 4.0 / radius**2), atol=1e-3 * pressure)
    np.testing.assert_allclose(stress[:, 2, 2], 2.0 * ratio * mean, atol=1e-3 * pressure)
    found = solution.report.balance
    np.testing.assert_allclose(found.reactions["symmetry 'x < 1e-9'"][0], -0.5 * pressure, rtol=1e-4)  # on 0.5 x 1
    assert found.imbalance < 1e-9


def test_a_thick_sphere():
    """Lame: radii 1 and 2 under inner pressure; a 24th, cut off by four planes of symmetry, two of them oblique."""
    pressure = 10.0

    def cut(u, v, w):
        s, t = np.tan(v * np.pi / 4), np.tan(w * np.pi / 4)
        size = (1.0 + u) / np.sqrt(1.0 + s * s + t * t)
        return size * s, size * t, size

    body = iga_nn.BSplineVolume.from_function(cut, (14, 8, 8))
    conditions = {
        "symmetry": "abs(nx*x + ny*y + nz*z) < 0.5",
        "pressure": {"nx*x + ny*y + nz*z < -0.5": pressure},
    }
    solution = iga_nn.solve(body, iga_nn.Elasticity(young=200.0, poisson_ratio=0.3, **conditions), estimate=False)
    where = places()
    x = body(where)
    radius = np.linalg.norm(x, axis=1)
    stress = solution.quantity("stress", where)
    radial = along(stress, x / radius[:, None])
    hoop = 0.5 * (np.trace(stress, axis1=1, axis2=2) - radial)
    np.testing.assert_allclose(radial, pressure / 7.0 * (1.0 - 8.0 / radius**3), atol=1e-3 * pressure)
    np.testing.assert_allclose(hoop, pressure / 7.0 * (1.0 + 4.0 / radius**3), rtol=1e-3)


def kirsch(x, y):
    """The traction (2, m) of Kirsch's plate on circles about its hole of radius 1, pulled along x by 1 far away."""
    angle, q = np.arctan2(y, x), 1.0 / (x * x + y * y)
    cos, sin = np.cos(2.0 * angle), np.sin(2.0 * angle)
    radial = 0.5 * (1.0 - q) + 0.5 * (1.0 - 4.0 * q + 3.0 * q * q) * cos
    shear = -0.5 * (1.0 + 2.0 * q - 3.0 * q * q) * sin
    c, s = np.cos(angle), np.sin(angle)
    return radial * c - shear * s, radial * s + shear * c


def test_a_plate_with_a_hole():
    """Kirsch: a quarter out to 4 radii of the hole, where the exact traction of the infinite plate acts."""

    def quarter(u, v, w):
        return 4.0**u * np.cos(v * np.pi / 2), 4.0**u * np.sin(v * np.pi / 2), 0.25 * w

    body = iga_nn.BSplineVolume.from_function(quarter, (12, 10, 4))
    outer = [lambda x, y, z: kirsch(x, y)[0], lambda x, y, z: kirsch(x, y)[1], "0"]
    conditions = {"symmetry": ["x < 1e-9", "y < 1e-9", "abs(nz) > 0.99"], "load": {"nx*x + ny*y > 2": outer}}
    solution = iga_nn.solve(body, iga_nn.Elasticity(poisson_ratio=0.3, **conditions), estimate=False)
    top, side = solution.quantity("stress", body.locate([[0.0, 1.0, 0.1], [1.0, 0.0, 0.1]]))
    assert top[0, 0] == pytest.approx(3.0, rel=1e-2)
    assert side[1, 1] == pytest.approx(-1.0, rel=1e-2)


def test_a_twisted_bar():
    """Saint-Venant: a square bar, its ends turned about the axis and free to warp. The torsion constant is 0.140577."""
    length, angle = 2.0, 0.1
    turned = {"nx < -0.99": (None, 0, 0), "nx > 0.99": (None, f"-{angle}*z", f"{angle}*y")}
    middle = {"abs(nx) > 0.99 and y*y + z*z < 0.01": (0, None, None)}  # where the warping is none
    law = iga_nn.Elasticity(young=2.6, poisson_ratio=0.3, fix=turned | middle)  # a shear modulus of 1
    solution = iga_nn.solve(block(length, (4, 8, 8)), law, estimate=False)

    def moment(u, grad, x):
        stress = law.flux(u, grad, x)
        return x[1] * stress[2, 0] - x[2] * stress[1, 0]

    for end in ("nx > 0.99", "nx < -0.99"):
        assert iga_nn.integrate(solution, moment, over=end) == pytest.approx(0.140577 * angle / length, rel=1e-3)
    assert solution.extremes(lambda u, grad, x: law.flux(u, grad, x)[1, 0]).largest == pytest.approx(
        0.675 * angle / length, rel=1e-2
    )  # in the middle of the sides


def test_a_fin_that_cools():
    length, thickness, kappa, alpha, base, outside = 5.0, 0.1, 200.0, 0.5, 100.0, 20.0
    fin = iga_nn.BSplineVolume.from_function(lambda u, v, w: (length * u, v, thickness * w), (8, 4, 4))
    law = iga_nn.Poisson(kappa=kappa, value={"nx < -0.99": base}, exchange={"abs(nz) > 0.99": (alpha, outside)})
    solution = iga_nn.solve(fin, law, estimate=False)
    m = np.sqrt(2.0 * alpha / (kappa * thickness))
    tip = outside + (base - outside) / np.cosh(m * length)
    heat = kappa * thickness * m * (base - outside) * np.tanh(m * length)
    assert solution.probe([[length, 0.5, 0.5 * thickness]])[0] == pytest.approx(tip, rel=1e-3)
    flows = solution.report.balance.reactions
    assert flows["value 'nx < -0.99'"][0] == pytest.approx(heat, rel=1e-3)
    assert flows["exchange 'abs(nz) > 0.99'"][0] == pytest.approx(-flows["value 'nx < -0.99'"][0], rel=1e-9)


def test_a_beam_that_vibrates():
    length, density, young = 20.0, 2.0, 1000.0
    law = iga_nn.Elasticity(young=young, poisson_ratio=0.3, fix="nx < -0.99")
    found = iga_nn.modes(block(length, (14, 4, 4)), law, density=density, n=2)
    bending = 1.8751040687**2 / (2.0 * np.pi) * np.sqrt(young / 12.0 / density / length**4)  # Euler and Bernoulli
    np.testing.assert_allclose(found.frequencies, bending, rtol=5e-3)  # in both directions
    assert found.rigid == 0


def test_areas_of_regions():
    slab = block(4.0, 5)
    assert iga_nn.integrate(slab, over="nz > 0.99 and x < 1.3") == pytest.approx(1.3, rel=1e-6)
    assert iga_nn.integrate(slab, over="nz > 0.99 and (x-2)*(x-2) + y*y < 0.16") == pytest.approx(
        0.16 * np.pi, rel=1e-4
    )
    assert iga_nn.integrate(slab, over=["x < 1", "nx < -0.5"]) == pytest.approx(5.0, rel=1e-6)  # their union
    assert iga_nn.integrate(slab, over=iga_nn.Region("nz > 0.9") - iga_nn.Region("x < 1")) == pytest.approx(
        3.0, rel=1e-6
    )
    assert iga_nn.integrate(slab, lambda x: x[0], over="ny > 0.9") == pytest.approx(8.0, rel=1e-12)
    assert iga_nn.integrate(slab, over="Z > 0 and nz > 0.9") == pytest.approx(4.0, rel=1e-12)
    with pytest.raises(ValueError, match="over 'x > 9': no part of the boundary lies there"):
        iga_nn.integrate(slab, over="x > 9")


@pytest.mark.parametrize("radius", [0.02, 0.05, 0.3])
def test_small_regions_have_their_area_on_coarse_meshes(radius):
    plate = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), 5)
    disc = f"nz > 0.99 and (x-1.2345)*(x-1.2345) + (y-0.4321)*(y-0.4321) < {radius**2}"
    assert iga_nn.integrate(plate, over=disc) == pytest.approx(np.pi * radius**2, rel=1e-4)


def test_the_divergence_theorem_on_a_curved_body():
    def curved(u, v, w):
        return (1.0 + u) * np.cos(v) + 0.1 * w * w, (1.0 + u) * np.sin(v) - 0.2 * u * w, w + 0.2 * u * v

    body = iga_nn.BSplineVolume.from_function(curved, 6)
    (position,) = iga_nn.solve(body, iga_nn.Poisson(exact="x"), estimate=False).patches
    position = replace(position, coefficients=body.control_points[..., 0])  # x without the linear solver's rest
    whole = "nx*nx + ny*ny + nz*nz > 0.5"
    assert abs(iga_nn.resultant(position, whole)[0]) < 1e-10  # of the flux e_x, whose divergence is zero
    growing = replace(position, problem=iga_nn.Poisson(exact="x", kappa="x"))
    assert iga_nn.resultant(growing, whole)[0] == pytest.approx(iga_nn.integrate(body), rel=1e-10)  # of x e_x: 1
    halves = iga_nn.resultant(growing, "nz > 0") + iga_nn.resultant(growing, "not (nz > 0)")
    assert halves[0] == pytest.approx(iga_nn.integrate(body), rel=1e-4)
