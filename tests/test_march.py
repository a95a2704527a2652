"""Steps in time: their order, series that are known, and what a march leaves."""

import re

import numpy as np
import pytest

import iga_nn
from solve import ConvergenceError, benchmark_volume

FACES = ("u0", "u1", "v0", "v1", "w0", "w1")
STILL = iga_nn.Poisson(source="0", boundary="0")


def cube(n=7):
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=n)


def swinging(time):
    """u = x cos t, with data of time on all kinds of faces."""
    return iga_nn.Poisson(
        exact=f"x*cos({time})", source=f"2*x*cos({time})-3*x*sin({time})", reaction="2", neumann={"u1": None},
        robin={"v0": ("1", None)},
    )  # fmt: skip


@pytest.mark.parametrize("scheme", ["bdf2", "trapezoidal"])
def test_both_schemes_are_of_second_order(scheme):
    """On a box with slanted sides all integrals of u = x cos t are exact: the error is that of time. Capacity 3."""
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + 0.3 * v, v, w + 0.1 * u), control_points=5)
    errors = []
    for steps in (8, 16, 32):
        found = iga_nn.march(volume, swinging, "x", dt=1.0 / steps, steps=steps, scheme=scheme, capacity=3.0)
        errors.append(np.abs(found.fields[-1].coefficients - np.cos(1.0) * volume.control_points[..., 0]).max())
    assert errors[-1] < 1e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1)


def series(time, place):
    """The heat in a unit cube that starts as the product of x (1 - x): a product of sine series."""
    k = np.arange(1, 60, 2)
    one = [(8.0 / (np.pi * k) ** 3 * np.sin(np.pi * k * x) * np.exp(-((np.pi * k) ** 2) * time)).sum() for x in place]
    return np.prod(one)


@pytest.mark.parametrize("scheme", ["bdf2", "trapezoidal"])
def test_heat_in_a_cube_is_the_series(scheme):
    found = iga_nn.march(cube(), STILL, "x*(1-x)*y*(1-y)*z*(1-z)", dt=1e-3, steps=40, scheme=scheme, every=20)
    assert found.times == pytest.approx([0.0, 0.02, 0.04])
    place = (0.5, 0.3, 0.6)
    for time, field in zip(found.times, found.fields, strict=True):
        assert field([place])[0] == pytest.approx(series(time, place), rel=3e-3)


@pytest.mark.parametrize("scheme", ["bdf2", "trapezoidal"])
def test_energy_only_decays_and_heat_is_kept_by_insulation(scheme):
    """With insulated walls the integral of u stays, and that of its square falls to that of the mean's."""
    volume = benchmark_volume(2)
    system = iga_nn.discretize(volume, iga_nn.Poisson(source="0", reaction="1", neumann=dict.fromkeys(FACES, "0")))
    insulated = iga_nn.Poisson(source="0", neumann=dict.fromkeys(FACES, "0"))
    found = iga_nn.march(volume, insulated, "exp(x)*y", dt=0.02, steps=20, scheme=scheme, tolerance=1e-12)
    ones, energies, heat = np.ones(len(system.load)), [], []
    for field in found.fields:
        x = system.vector(field)
        energies.append(x @ (system.mass @ x))
        heat.append(ones @ (system.mass @ x))
    assert np.all(np.diff(energies) < 0.0)
    assert heat == pytest.approx([heat[0]] * len(heat), rel=1e-9)
    assert energies[-1] > heat[0] ** 2 / (ones @ (system.mass @ ones))


def test_vectors_and_laws_that_are_not_symmetric():
    """Elastic creep toward the solution at rest; and a wind, which GMRES solves."""
    volume = benchmark_volume(2)
    body = iga_nn.Elasticity(body_force=("0", "0", "-1"), young=10.0)
    last = iga_nn.march(volume, body, ("0", "0", "0"), dt=0.5, steps=8).fields[-1]
    assert np.allclose(last.coefficients, iga_nn.solve(volume, body).coefficients, atol=1e-6)

    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):
            return grad

        def react(self, u, grad, x):
            return 3.0 * grad[:, 0]

    windy = iga_nn.Problem(Wind(), source="1")
    last = iga_nn.march(volume, windy, "0", dt=0.2, steps=10).fields[-1]
    assert np.allclose(last.coefficients, iga_nn.solve(volume, windy).coefficients, atol=1e-5)


def test_a_march_goes_on_from_a_field_and_tells_every_step():
    volume, seen = benchmark_volume(2), []
    whole = iga_nn.march(volume, swinging, "x", dt=0.1, steps=4, scheme="trapezoidal")
    half = iga_nn.march(volume, swinging, "x", dt=0.1, steps=2, scheme="trapezoidal", every=2)
    rest = iga_nn.march(
        volume, swinging, half.fields[-1], dt=0.1, steps=2, scheme="trapezoidal", first=0.2,
        callback=lambda time, field: seen.append((time, field.coefficients.shape)),
    )  # fmt: skip
    assert np.allclose(rest.fields[-1].coefficients, whole.fields[-1].coefficients, atol=1e-8)
    assert seen == [(pytest.approx(0.3), (5, 5, 5)), (pytest.approx(0.4), (5, 5, 5))]
    assert len(half.fields) == 2 and len(half.iterations) == 2


def test_a_series_for_paraview(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    found = iga_nn.march(cube(4), STILL, "1", dt=0.01, steps=2)
    found.save_pvd(tmp_path / "film.pvd", samples=2)
    text = (tmp_path / "film.pvd").read_text()
    assert re.findall(r'timestep="([\d.]+)".*file="(\w+\.vtu)"', text) == [
        ("0.0", "film_0000.vtu"), ("0.01", "film_0001.vtu"), ("0.02", "film_0002.vtu"),
    ]  # fmt: skip
    reader = pyvista.get_reader(tmp_path / "film.pvd")
    assert reader.time_values == [0.0, 0.01, 0.02]
    assert 0.0 < pyvista.read(tmp_path / "film_0002.vtu")["u"].max() < 1.0
    assert {file.suffix for file in tmp_path.iterdir()} == {".pvd", ".vtu"}  # nothing unfinished is left
    with pytest.raises(ValueError, match=r"ends in .pvd"):
        found.save_pvd(tmp_path / "film.vtu")


def test_what_cannot_be_marched_is_refused():
    volume = benchmark_volume(2)
    for wrong, says in (
        ({"dt": 0.0}, "dt must be a positive number"),
        ({"steps": 0}, "steps must be a whole number"),
        ({"scheme": "leap"}, "scheme must be one of bdf2, trapezoidal, got 'leap'"),
        ({"capacity": -1.0}, "capacity must be"),
        ({"start": "q"}, "start: expression"),
        ({"start": ("1", "2")}, "start must have one|start must have 1"),
    ):
        given = {"start": "0", "dt": 0.1, "steps": 1} | wrong
        with pytest.raises(ValueError, match=says):
            iga_nn.march(volume, STILL, **given)

    with pytest.raises(TypeError, match="callback must be a function of a time and a field, or None, got 3"):
        iga_nn.march(volume, STILL, "0", dt=0.1, steps=1, callback=3)

    def turning(time):
        return STILL if time < 0.15 else iga_nn.Poisson(source="0", neumann={"u1": "0"})

    with pytest.raises(ValueError, match="the problem of time 0.2 has data on other faces than that of the first time"):
        iga_nn.march(volume, turning, "0", dt=0.1, steps=2)
    with pytest.raises(ConvergenceError, match="no convergence at time 0.1"):
        iga_nn.march(volume, STILL, "1", dt=0.1, steps=1, max_iterations=1)
