r"""A part from CAD
===============

An angle with a fillet and two bores in each leg, as CAD writes it: a STEP file with exact faces. It becomes curved
hexahedra, each of them proved, and its edges stay sharp. The bores of one leg are held, the other leg is pulled.
Millimetres, newtons and MPa.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from common import draw
from netgen.occ import Box, Cylinder, Pnt, X, Z

import iga_nn

LEG, WIDTH, THICK, FILLET, BORE = 60.0, 40.0, 6.0, 8.0, 4.0
HELD, PULLED = "z < 6 and nz < 0.5 and nz > -0.5 and x > 20 and x < 50 and y > 5 and y < 35", "nz > 0.99 and z > 59"


def angle(path: Path) -> Path:
    """Write the part as a STEP file."""
    whole = Box(Pnt(0, 0, 0), Pnt(LEG, WIDTH, THICK)) + Box(Pnt(0, 0, 0), Pnt(THICK, WIDTH, LEG))
    inner = [edge for edge in whole.edges if (edge.center - Pnt(THICK, WIDTH / 2, THICK)).Norm() < 1e-6]
    whole = whole.MakeFillet(inner, FILLET)
    for y in (10.0, 30.0):
        whole -= Cylinder(Pnt(35, y, -1), Z, BORE, THICK + 2)
        whole -= Cylinder(Pnt(-1, y, 42), X, BORE, THICK + 2)
    path.parent.mkdir(parents=True, exist_ok=True)
    whole.WriteStep(str(path))
    return path


def main(out: str | Path = "out/cad_part") -> Path:
    """Print the proof, the displacement and the stress; returns the picture of the bent part."""
    surface = iga_nn.load_surface(angle(Path(out) / "angle.step"))
    config = iga_nn.preset("fast")
    config = replace(config, spline=replace(config.spline, degree=2))
    result = iga_nn.parameterize(surface, config)
    print(result.decomposition)
    print(result.certificate)
    body = iga_nn.Elasticity(young=210000.0, poisson_ratio=0.3, fix=HELD, load={PULLED: (1.0, 0.0, 0.0)})
    solution = iga_nn.solve(result.volume, body.on_surface(result.boundary.part))
    print(solution.report)
    print("displacement", solution.extremes("magnitude"))
    return draw(out, result.volume, solution, "displacement, drawn 50 times too large", exaggerate=50.0)


if __name__ == "__main__":
    main()
