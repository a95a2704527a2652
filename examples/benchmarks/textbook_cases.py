"""Problems of textbooks: body, loads, supports, and the true values of what is asked, from the formulas.

No problem is told its exact solution: it has loads and supports, as a user gives them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from exact_fields import Displacement, Place, Temperature, toward
from rational_bodies import ball_shell, block, graded_block, quarter_plate, quarter_ring, round_bar

import iga_nn
from parameterize.arrays import Array

HALVINGS = 6  # of spans toward the edges of a clamped face; two more change the deflection by 1.4e-4


@dataclass(frozen=True)
class Case:
    """A problem with true values, by what is asked."""

    name: str
    body: iga_nn.Body
    problem: iga_nn.Elasticity | iga_nn.Poisson
    truths: Mapping[str, float]


def stresses(field: Displacement, *asked: tuple[str, Place]) -> dict[str, float]:
    """Return what is asked of components of the stress, such as "xy", at places, with its true values."""
    return {
        f"stress_{name} at {place}": field.stress(place, "xyz".index(name[0]), "xyz".index(name[1]))
        for name, place in asked
    }


def kirsch() -> Case:
    """Return a quarter of a plate with a hole in plane strain, pulled along x as the infinite plate is (Kirsch)."""
    pull, half, height = 10.0, 4.0, 0.5
    young, ratio = 1000.0, 0.3
    factor, kappa = pull * (1.0 + ratio) / (4.0 * young), 3.0 - 4.0 * ratio  # pull / 8 mu

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        square = x * x + y * y
        wave, sine = (x**3 - 3.0 * x * y * y) / square, (3.0 * x * x * y - y**3) / square  # r cos 3t, r sin 3t
        first = (kappa + 1.0) * x + 2.0 / square * ((1.0 + kappa) * x + wave) - 2.0 / square**2 * wave
        second = (kappa - 3.0) * y + 2.0 / square * ((1.0 - kappa) * y + sine) - 2.0 / square**2 * sine
        return [factor * first, factor * second, 0.0 * x]

    field, body = Displacement(displacement, young, ratio), quarter_plate(half, height)
    problem = iga_nn.Elasticity(
        **field.material,
        symmetry=["p0_v0", "p1_v1", "w0", "w1"],
        load={"p0_u1": field.through(toward(1, 0, 0)), "p1_u1": field.through(toward(0, 1, 0))},
    )
    top, side, outside = (0.0, 1.0, 0.25), (1.0, 0.0, 0.25), (half, 0.0, 0.25)
    truths = {
        f"ux at {outside}": field.at(outside),
        f"uy at {top}": field.at(top, 1),
        "mean ux over p0_u1": field.mean(body, 0, "p0_u1"),
        **stresses(field, ("xx", top), ("yy", side)),
        "von_mises max": field.von_mises(top),
        "reaction x of p1_v1": field.total(body, toward(-1, 0, 0), "p1_v1"),
        "energy": field.energy(body),
    }
    return Case("Kirsch's plate", body, problem, truths)


def lame() -> Case:
    """Return a quarter of a thick pipe in plane strain under pressure inside (Lame)."""
    a, b, height, pressure, young, ratio = 1.0, 2.0, 0.5, 10.0, 1000.0, 0.3
    factor = (1.0 + ratio) * pressure * a * a / (young * (b * b - a * a))

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        outward = factor * (1.0 - 2.0 * ratio + b * b / (x * x + y * y))
        return [outward * x, outward * y, 0.0 * z]

    field, body = Displacement(displacement, young, ratio), quarter_ring((a, b), height)
    problem = iga_nn.Elasticity(**field.material, symmetry=["v0", "v1", "w0", "w1"], pressure={"u0": pressure})
    inside, outside = (a, 0.0, 0.25), (b, 0.0, 0.25)
    truths = {
        f"ux at {inside}": field.at(inside),
        f"ux at {outside}": field.at(outside),
        "mean ux over u1": field.mean(body, 0, "u1"),
        **stresses(field, ("yy", inside), ("xx", inside), ("yy", outside)),
        "von_mises max": field.von_mises(inside),
        "reaction z of w1": field.total(body, toward(0, 0, 1), "w1", 2),
        "energy": field.energy(body),
    }
    return Case("Lamé's pipe", body, problem, truths)


def boussinesq() -> Case:
    """Return a block of a half space z > 0 below the point where a force acts on its surface (Boussinesq)."""
    force, young, ratio = 100.0, 1000.0, 0.3
    factor = force * (1.0 + ratio) / (2.0 * np.pi * young)  # P / 4 pi mu

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        away = np.sqrt(x * x + y * y + z * z)
        outward = factor / away * (z / away**2 - (1.0 - 2.0 * ratio) / (away + z))
        return [outward * x, outward * y, factor / away * (2.0 * (1.0 - ratio) + z * z / away**2)]

    field, body = Displacement(displacement, young, ratio), block((0, 0, 0.5), (1, 1, 1.5))
    problem = iga_nn.Elasticity(
        **field.material,
        symmetry=["u0", "v0"],
        fix={"w1": field.data()},
        load={
            "u1": field.through(toward(1, 0, 0)),
            "v1": field.through(toward(0, 1, 0)),
            "w0": field.through(toward(0, 0, -1)),
        },
    )
    below, corner = (0.0, 0.0, 0.5), (1.0, 1.0, 0.5)
    truths = {
        f"uz at {below}": field.at(below, 2),
        f"ux at {corner}": field.at(corner),
        "mean uz over w0": field.mean(body, 2, "w0"),
        "mean uz": field.mean(body, 2),
        **stresses(field, ("zz", below), ("xx", below)),
        "von_mises max": field.von_mises(below),
        "reaction z of w1": field.total(body, toward(0, 0, 1), "w1", 2),
        "energy": field.energy(body),
    }
    return Case("Boussinesq's half space", body, problem, truths)


def cantilever() -> Case:
    """Return a round bar with a force across its end, the bar's root moved as Saint-Venant's solution is."""
    length, force, young, ratio = 4.0, 1.0, 1000.0, 0.3
    factor = force / (young * np.pi / 4.0)  # of radius 1

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        bent = 0.5 * ratio * (length - z) * (x * x - y * y) + 0.5 * length * z**2 - z**3 / 6.0
        side = ratio * (length - z) * x * y
        along = -x * (length * z - 0.5 * z * z) - 0.25 * x * y * y + 0.25 * ((3.0 + 2.0 * ratio) * x - x**3)
        return [factor * bent, factor * side, factor * along]

    field, body = Displacement(displacement, young, ratio), round_bar(1.0, 1.0, length)
    problem = iga_nn.Elasticity(**field.material, fix={"w0": field.data()}, load={"w1": field.through(toward(0, 0, 1))})
    tip, lower, middle = (0.0, 0.0, length), (-1.0, 0.0, 2.0), (0.0, 0.0, 2.0)
    truths = {
        f"ux at {tip}": field.at(tip),
        "mean ux over w1": field.mean(body, 0, "w1"),
        **stresses(field, ("zz", (-1.0, 0.0, 1.0)), ("xz", middle)),
        "von_mises max over z > 2": field.von_mises(lower),
        "reaction x of w0": field.total(body, toward(0, 0, -1), "w0"),
        "energy": field.energy(body),
    }
    return Case("cantilever", body, problem, truths)


def torsion() -> Case:
    """Return an elliptic bar in torsion (Saint-Venant), its end at z = 0 moved as in the formula."""
    a, b, length, twist, young, ratio = 2.0, 1.0, 3.0, 0.01, 1000.0, 0.3

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        return [-twist * y * z, twist * x * z, -twist * (a * a - b * b) / (a * a + b * b) * x * y]

    field, body = Displacement(displacement, young, ratio), round_bar(a, b, length)
    problem = iga_nn.Elasticity(**field.material, fix={"w0": field.data()}, load={"w1": field.through(toward(0, 0, 1))})
    end, thin = (0.0, b, length), (0.0, b, 1.5)
    truths = {
        f"ux at {end}": field.at(end),
        f"uz at {(1.2, 0.6, 2.0)}": field.at((1.2, 0.6, 2.0), 2),
        **stresses(field, ("xz", thin), ("yz", (a, 0.0, 1.5))),
        "von_mises max": field.von_mises(thin),
        "energy": field.energy(body),
    }
    return Case("torsion of an elliptic bar", body, problem, truths)


def cavity() -> Case:
    """Return an eighth of a ball with a cavity under pressure (Lame), cut by a cone below its top."""
    a, b, top, pressure, young, ratio = 1.0, 2.0, 60.0, 10.0, 1000.0, 0.3
    factor = pressure * a**3 / (young * (b**3 - a**3))

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        cube = (x * x + y * y + z * z) ** 1.5
        outward = factor * (1.0 - 2.0 * ratio + 0.5 * (1.0 + ratio) * b**3 / cube)
        return [outward * x, outward * y, outward * z]

    def of_cone(x: Array) -> Array:
        flat, away = np.hypot(x[0], x[1]), np.sqrt((x * x).sum(axis=0))
        return np.stack([-x[2] * x[0] / flat, -x[2] * x[1] / flat, flat]) / away

    field, body = Displacement(displacement, young, ratio), ball_shell(a, b, top)
    problem = iga_nn.Elasticity(
        **field.material,
        symmetry=["v0", "v1", "w0"],
        pressure={"u0": pressure},
        load={"w1": field.through(of_cone)},
    )
    inside, outside = (a, 0.0, 0.0), (b, 0.0, 0.0)
    truths = {
        f"ux at {inside}": field.at(inside),
        f"ux at {outside}": field.at(outside),
        **stresses(field, ("yy", inside), ("zz", outside)),
        "von_mises max": field.von_mises(inside),
        "reaction z of w0": field.total(body, toward(0, 0, -1), "w0", 2),
        "energy": field.energy(body),
    }
    return Case("ball with a cavity", body, problem, truths)


def rotating() -> Case:
    """Return a quarter of a thick ring in plane strain that rotates about its axis."""
    a, b, height, pull, young, ratio = 1.0, 3.0, 0.5, 10.0, 1000.0, 0.3  # pull: density times angular velocity squared
    shear = young / (2.0 * (1.0 + ratio))
    first = 2.0 * shear * ratio / (1.0 - 2.0 * ratio)
    stiff = first + 2.0 * shear
    cubic = -pull / (8.0 * stiff)  # u = c r + d / r + cubic r^3

    def freed(r: float) -> list[float]:
        return [2.0 * (first + shear), -2.0 * shear / r**2]

    sides = [-cubic * r * r * (3.0 * stiff + first) for r in (a, b)]
    c, d = np.linalg.solve(np.array([freed(a), freed(b)]), np.array(sides))

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        square = x * x + y * y
        outward = c + d / square + cubic * square
        return [outward * x, outward * y, 0.0 * z]

    field, body = Displacement(displacement, young, ratio), quarter_ring((a, b), height)
    problem = iga_nn.Elasticity(
        **field.material, symmetry=["v0", "v1", "w0", "w1"], body_force=(f"{pull}*x", f"{pull}*y", "0")
    )
    inside, outside = (a, 0.0, 0.25), (b, 0.0, 0.25)
    truths = {
        f"ux at {inside}": field.at(inside),
        f"ux at {outside}": field.at(outside),
        "mean ux": field.mean(body),
        **stresses(field, ("yy", inside), ("yy", outside)),
        "von_mises max": field.von_mises(inside),
        "energy": field.energy(body),
    }
    return Case("rotating ring", body, problem, truths)


def shrunk() -> Case:
    """Return a quarter of a pipe of two materials in plane strain under pressure inside."""
    radii, height, pressure = (1.0, 1.5, 2.0), 0.5, 10.0
    materials = ((1000.0, 0.3), (200.0, 0.4))
    fields = _layers(radii, pressure, materials)
    body = quarter_ring(radii, height)
    problem = iga_nn.Elasticity(
        young={0: 1000.0, 1: 200.0},
        poisson_ratio={0: 0.3, 1: 0.4},
        symmetry=["v0", "v1", "w0", "w1"],
        pressure={"p0_u0": pressure},
    )
    inner, outer = fields
    inside, outside, between = ((r, 0.0, 0.25) for r in (1.0, 2.0, 1.5))
    force = sum(
        field.total(quarter_ring(radii[i : i + 2], height), toward(0, 0, 1), "w1", 2) for i, field in enumerate(fields)
    )
    energy = 0.5 * pressure * inner.at(inside) * 0.5 * np.pi * height
    truths = {
        f"ux at {inside}": inner.at(inside),
        f"ux at {between}": inner.at(between),
        f"ux at {outside}": outer.at(outside),
        f"stress_yy at {inside}": inner.stress(inside, 1, 1),
        f"stress_yy at {outside}": outer.stress(outside, 1, 1),
        "von_mises max": inner.von_mises(inside),
        "reaction z of w1": force,
        "energy": energy,
    }
    return Case("pipe of two materials", body, problem, truths)


def _layers(
    radii: tuple[float, float, float], pressure: float, materials: tuple[tuple[float, float], ...]
) -> list[Displacement]:
    """Return the displacements c r + d / r of the two layers: no pressure outside, glued where they meet."""
    shears = [young / (2.0 * (1.0 + ratio)) for young, ratio in materials]
    pulls = [shear / (1.0 - 2.0 * ratio) for shear, (_, ratio) in zip(shears, materials, strict=True)]  # first + shear
    inner, middle, outer = radii

    def pushed(layer: int, r: float) -> list[float]:
        return [2.0 * pulls[layer], -2.0 * shears[layer] / r**2]

    rows = [
        [*pushed(0, inner), 0.0, 0.0],
        [0.0, 0.0, *pushed(1, outer)],
        [middle, 1.0 / middle, -middle, -1.0 / middle],
        [*pushed(0, middle), *(-part for part in pushed(1, middle))],
    ]
    found = np.linalg.solve(np.array(rows), np.array([-pressure, 0.0, 0.0, 0.0]))
    return [Displacement(_outward(*found[2 * i : 2 * i + 2]), *materials[i]) for i in (0, 1)]


def _outward(c: float, d: float) -> Callable[[Array, Array, Array], list[Array]]:
    """Return the displacement c r + d / r away from the z axis."""

    def displacement(x: Array, y: Array, z: Array) -> list[Array]:
        outward = c + d / (x * x + y * y)
        return [outward * x, outward * y, 0.0 * z]

    return displacement


def fin() -> Case:
    """Return a plate fin that gives heat to the air on its side: cosh along it, a cosine across; its tip insulated."""
    length, half, kappa, wave = 3.0, 0.5, 2.0, 1.2
    exchange = kappa * wave * np.tan(wave * half)

    def temperature(x: Array, y: Array, z: Array) -> Array:
        return 100.0 * np.cosh(wave * (length - x)) / np.cosh(wave * length) * np.cos(wave * z)

    field, body = Temperature(temperature, kappa), block((0, 0, 0), (length, 1.0, half))
    problem = iga_nn.Poisson(kappa=kappa, value={"u0": field.data()[0]}, exchange={"w1": (exchange, 0.0)})
    tip, side = (length, 0.5, 0.0), (1.0, 0.5, half)
    truths = {
        f"T at {tip}": field.at(tip),
        f"T at {side}": field.at(side),
        "mean T": field.mean(body),
        "mean T over u1": field.mean(body, 0, "u1"),
        "flow over u0": field.total(body, toward(-1, 0, 0), "u0"),
        "flow over w1": field.total(body, toward(0, 0, 1), "w1"),
        "energy": field.energy(body),
    }
    return Case("fin", body, problem, truths)


def heated() -> Case:
    """Return a round bar with a source of heat, which it gives to the air around it; its ends are insulated."""
    source, kappa, exchange, outside = 8.0, 2.0, 3.0, 20.0

    def temperature(x: Array, y: Array, z: Array) -> Array:
        return outside + source / (2.0 * exchange) + source * (1.0 - x * x - y * y) / (4.0 * kappa) + 0.0 * z

    field, body = Temperature(temperature, kappa), round_bar(1.0, 1.0, 1.0)
    around = " or ".join(f"p{number}_u1" for number in range(1, 5))
    problem = iga_nn.Poisson(source=source, kappa=kappa, exchange={around: (exchange, outside)})
    middle, side = (0.0, 0.0, 0.5), (1.0, 0.0, 0.5)
    truths = {
        f"T at {middle}": field.at(middle),
        f"T at {side}": field.at(side),
        "mean T": field.mean(body),
        "max T": field.at(middle),
        f"gradient_x at {side}": -source / (2.0 * kappa),
        f"flow over {around}": -source * np.pi,
        "energy": field.energy(body),
    }
    return Case("heated bar", body, problem, truths)


def layered() -> Case:
    """Return a quarter of a pipe of two materials, hot inside: its temperature is a logarithm in each."""
    radii, kappas, hot, height = (1.0, 1.5, 3.0), (1.0, 8.0), 100.0, 0.5
    resistances = [np.log(b / a) / kappa for a, b, kappa in zip(radii, radii[1:], kappas, strict=False)]
    through = hot / sum(resistances)  # heat through a radian and a unit of height
    between = hot - through * resistances[0]
    body = quarter_ring(radii, height)
    problem = iga_nn.Poisson(kappa=dict(enumerate(kappas)), value={"p0_u0": hot, "p1_u1": 0.0})

    def integral(start: float, a: float, b: float, kappa: float) -> float:
        """Return the integral of (start - through / kappa log(r / a)) r from a to b."""
        logs = 0.5 * b * b * np.log(b / a) - 0.25 * (b * b - a * a)
        return float(0.5 * start * (b * b - a * a) - through / kappa * logs)

    total = integral(hot, *radii[:2], kappas[0]) + integral(between, *radii[1:], kappas[1])
    flow = through * 0.5 * np.pi * height
    truths = {
        f"T at {(1.5, 0.0, 0.25)}": between,
        f"T at {(1.2, 0.0, 0.25)}": hot - through * np.log(1.2) / kappas[0],
        "mean T": 2.0 * total / (radii[2] ** 2 - radii[0] ** 2),
        "flow over p0_u0": flow,
        f"gradient_x at {(1.0, 0.0, 0.25)}": -through / kappas[0],
        "energy": 0.5 * hot * flow,
    }
    return Case("hot pipe of two materials", body, problem, truths)


def clamped() -> Case:
    """Return a square bar that is clamped at its end, with a force across the other.

    No formula is known: true values are those of a mesh graded toward the edges of the clamped face, right to 3e-4.
    """
    size = (4.0, 1.0, 1.0)
    problem = iga_nn.Elasticity(young=1000.0, poisson_ratio=0.3, fix="u0", load={"u1": (0.0, 0.0, -1.0)})
    asks = ("mean uz over u1", "uz at (4, 0.5, 0.5)", "mean von_mises over x > 1", "reaction z of u0", "energy")
    fine = iga_nn.solve(graded_block(size, HALVINGS), problem, ask=asks, estimate=False)
    truths = {answer.ask: answer.value for answer in fine.answers}
    return Case("clamped bar", block((0, 0, 0), size), problem, truths)


CASES: dict[str, Callable[[], Case]] = {
    "kirsch": kirsch,
    "lame": lame,
    "boussinesq": boussinesq,
    "cantilever": cantilever,
    "torsion": torsion,
    "cavity": cavity,
    "rotating": rotating,
    "shrunk": shrunk,
    "fin": fin,
    "heated": heated,
    "layered": layered,
    "clamped": clamped,
}
