"""A thick cylinder that yields under inner pressure: displacement and limit load beside Hill's formulas and felupe.

    python examples/benchmarks/plastic.py --out examples/benchmarks/results

The outer radius is twice the inner one, in plane strain, without hardening. The limit is p = 2 k ln(b / a) with
k = sigma_y / sqrt 3. While a plastic zone up to the radius c is inside of an elastic ring,

    p = 2 k (ln(c / a) + (1 - c^2 / b^2) / 2),        u(b) = 2 k (1 - nu^2) c^2 / (E b)

(Hill, The Mathematical Theory of Plasticity, 1950, chapter V); the first is exact where the axial stress is the mean of
the two others, and within some .3 % else. felupe (`pip install felupe`, not a part of this project) has biquadratic
elements of the same radii; it is read where it is installed.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
from processes import OneLineParser, as_markdown
from scipy.optimize import brentq

import iga_nn
from parameterize.files import save_text

INNER, OUTER, HEIGHT = 1.0, 2.0, 0.2
YOUNG, RATIO, YIELD = 200.0, 0.3, 1.0
SHEAR = YIELD / np.sqrt(3.0)
LIMIT = 2.0 * SHEAR * np.log(OUTER / INNER)
SHARE = 0.9  # of the limit, at which displacements are compared
BEYOND = 1.05  # of the limit, which no body carries
MESHES = ((2, 0), (2, 1), (3, 0))  # degree, refine
STEPS = 7
HEAD = ("solution", "unknowns", "u(b) at 0.9 of the limit", "beside Hill", "limit, of the formula's")


def cylinder(degree: int) -> iga_nn.BSplineVolume:
    """Return a quarter of the cylinder: u across its wall, v around it, w along it."""

    def at(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        radius, angle = INNER + (OUTER - INNER) * u, 0.5 * np.pi * v
        return radius * np.cos(angle), radius * np.sin(angle), HEIGHT * w

    return iga_nn.BSplineVolume.from_function(at, control_points=(5, 6, degree + 1), degree=degree)


def supports() -> list[iga_nn.Roller]:
    """Return the planes of symmetry and of plane strain."""
    return [iga_nn.Roller(face) for face in ("v0", "v1", "w0", "w1")]


def solved(share: float, degree: int, refine: int, steps: int) -> iga_nn.solve:
    """Return the solution under a share of the limit."""
    pressed = iga_nn.Pressure("u0", str(share * LIMIT))
    law = iga_nn.Plasticity(young=YOUNG, poisson_ratio=RATIO, yield_strength=YIELD, conditions=[*supports(), pressed])
    return iga_nn.solve(cylinder(degree), law, refine=refine, load_steps=steps)


def hill(share: float) -> float:
    """Return the displacement of the outer wall under a share of the limit."""

    def missing(c: float) -> float:
        return 2.0 * SHEAR * (np.log(c / INNER) + 0.5 * (1.0 - (c / OUTER) ** 2)) - share * LIMIT

    radius = brentq(missing, INNER, OUTER)
    return 2.0 * SHEAR * (1.0 - RATIO**2) * radius**2 / (YOUNG * OUTER)


def ours(degree: int, refine: int) -> list[str]:
    """Return the row of a mesh."""
    carried, broken = solved(SHARE, degree, refine, 4), solved(BEYOND, degree, refine, STEPS)
    moved = float(np.linalg.norm(carried([[1.0, 0.5, 0.5]])))
    return row(f"degree {degree}, refine {refine}", carried.report.dofs, moved, BEYOND * broken.report.load_factor)


def row(name: str, unknowns: int, moved: float, limit: float | None) -> list[str]:
    """Return a row of the table."""
    beside = f"{moved / hill(SHARE) - 1.0:+.2%}"
    return [name, f"{unknowns}", f"{moved:.6f}", beside, "-" if limit is None else f"{limit:.4f}"]


def felupe_row(around: int = 24, across: int = 16) -> list[str]:
    """Return the row of felupe's biquadratic elements in plane strain, whose step is not halved: without a limit."""
    import felupe as fem

    square = fem.mesh.convert(fem.Rectangle(n=(across + 1, around + 1)), order=2, calc_points=True, calc_midfaces=True)
    radius, angle = INNER + (OUTER - INNER) * square.points[:, 0], 0.5 * np.pi * square.points[:, 1]
    square.points[:] = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    region = fem.RegionBiQuadraticQuad(square)
    field = fem.FieldContainer([fem.FieldPlaneStrain(region, dim=2)])
    held = {
        "x": fem.Boundary(field[0], fx=lambda x: np.isclose(x, 0.0, atol=1e-9), skip=(0, 1)),
        "y": fem.Boundary(field[0], fy=lambda y: np.isclose(y, 0.0, atol=1e-9), skip=(1, 0)),
    }
    law = fem.LinearElasticPlasticIsotropicHardening(E=YOUNG, nu=RATIO, sy=YIELD, K=0.0)
    body = fem.SolidBody(law, field)
    forces = SHARE * LIMIT * inner_forces(square.points, around)
    load = fem.PointLoad(field, np.arange(len(forces)), values=0.0 * forces)
    shares = np.linspace(0.1, 1.0, 10)
    step = fem.Step(items=[body, load], ramp={load: np.multiply.outer(shares, forces)}, boundaries=held)
    fem.Job(steps=[step]).evaluate(tol=1e-8, verbose=0)
    outer = np.isclose(np.linalg.norm(square.points, axis=1), OUTER, atol=1e-6)
    moved = float(np.linalg.norm(field[0].values[outer], axis=1).mean())
    return row(f"felupe, {across} x {around} biquadratic", 2 * len(square.points), moved, None)


def inner_forces(points: np.ndarray, around: int) -> np.ndarray:
    """Return the forces (m, 2) of a pressure of 1 on the inner wall, on quadratic edges."""
    wall = np.flatnonzero(np.isclose(np.linalg.norm(points, axis=1), INNER, atol=1e-6))
    wall = wall[np.argsort(np.arctan2(points[wall, 1], points[wall, 0]))]
    forces, (places, weights) = np.zeros_like(points), np.polynomial.legendre.leggauss(3)
    for edge in range(around):
        own = wall[2 * edge : 2 * edge + 3]
        for s, weight in zip(places, weights, strict=True):
            values = np.array([s * (s - 1.0) / 2.0, 1.0 - s * s, s * (s + 1.0) / 2.0])
            along = np.array([s - 0.5, -2.0 * s, s + 0.5]) @ points[own]
            forces[own] += weight * values[:, None] * np.array([along[1], -along[0]])
    return forces


def main() -> None:
    """Print the table, and write it."""
    parser = OneLineParser(description="A thick cylinder that yields.")
    parser.add_argument("--out", type=Path)
    out = parser.parse_args().out
    rows = [ours(*mesh) for mesh in MESHES]
    if find_spec("felupe") is not None:
        rows.append(felupe_row())
    text = as_markdown(HEAD, rows)
    print(text)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        save_text(out / "plastic.md", text)


if __name__ == "__main__":
    main()
