"""A thick cylinder of rubber under inner pressure: three laws beside the integral of an incompressible one.

    python examples/benchmarks/rubber.py --out examples/benchmarks/results

The outer radius is twice the inner one, in plane strain. With the stretch s = r / R around the axis, between that of
the inner wall s_a and that of the outer wall s_b, the pressure is

    p = int_(s_b)^(s_a) 2 (w1 + w2) (s^2 - s^-2) / (s (s^2 - 1)) ds,        i1 = i2 = 1 + s^2 + s^-2

(Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis). Loads here are dead: the pressure per area
at rest is p s_a. The bulk modulus is 1 000 times the shear modulus, or 100 times.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from plastic import INNER, OUTER, cylinder, supports
from processes import OneLineParser, as_markdown
from scipy.integrate import quad

import iga_nn
from parameterize.files import save_text

STRETCH = 1.5  # of the inner wall
LAWS: dict[str, tuple[type, dict[str, float]]] = {
    "neo-Hooke": (iga_nn.NeoHookean, {"shear": 1.0}),
    "Mooney and Rivlin": (iga_nn.MooneyRivlin, {"c10": 0.35, "c01": 0.15}),
    "Yeoh": (iga_nn.Yeoh, {"c10": 0.5, "c20": -0.02, "c30": 0.005}),
}
MESHES = ((2, 0, 100.0), (2, 0, 1000.0), (3, 0, 1000.0))  # degree, refine, bulk over shear modulus
HEAD = ("law", "degree, refine", "K / mu", "unknowns", "stretch of the inner wall - 1", "beside the integral")


def load(law: Any) -> float:
    """Return the pressure per area at rest that stretches the inner wall."""
    outer = np.sqrt(1.0 + (STRETCH**2 - 1.0) * INNER**2 / OUTER**2)

    def slope(s: float) -> float:
        bent = s**2 + s**-2 - 2.0
        return float(2.0 * sum(law.slopes(bent, bent)) * (s**2 - s**-2) / (s * (s**2 - 1.0)))

    return float(quad(slope, outer, STRETCH)[0] * STRETCH)


def row(name: str, degree: int, refine: int, bulk: float) -> list[str]:
    """Return the row of a law on a mesh."""
    kind, numbers = LAWS[name]
    pressed = iga_nn.Pressure("u0", str(load(kind(fix="u0", **numbers))))
    law = kind(**numbers, bulk=bulk, conditions=[*supports(), pressed])
    solution = iga_nn.solve(cylinder(degree), law, refine=refine, load_steps=5)
    found = float(np.linalg.norm(solution([[0.0, 0.5, 0.5]]))) / INNER
    beside = f"{found / (STRETCH - 1.0) - 1.0:+.2%}"
    return [name, f"{degree}, {refine}", f"{bulk:g}", f"{solution.report.dofs}", f"{found:.5f}", beside]


def main() -> None:
    """Print the table, and write it."""
    parser = OneLineParser(description="A thick cylinder of rubber.")
    parser.add_argument("--out", type=Path)
    out = parser.parse_args().out
    rows = [row(name, *mesh) for name in LAWS for mesh in MESHES]
    text = as_markdown(HEAD, rows)
    print(text)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        save_text(out / "rubber.md", text)


if __name__ == "__main__":
    main()
