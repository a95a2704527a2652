"""Twenty CAD parts with supports, loads and asked quantities; in millimetres, newtons, megapascals, watts and kelvins.

The parts are those of `parts.py`, by set and name. Places are points of the parts, regions are faces of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import iga_nn

STEEL = {"young": 210000.0, "poisson_ratio": 0.3}
BOX = 10.0  # side of the boxes of MFCAD, of which pockets are cut


@dataclass(frozen=True)
class PartProblem:
    """A part with its problem and what is asked.

    refine: times spans are halved. degree: of the splines. finer: degree and refinement of the solve whose values are
    taken for the truth.
    """

    label: str
    problem: iga_nn.Elasticity | iga_nn.Poisson
    asks: tuple[str, ...]
    degree: int = 2
    refine: int = 0
    finer: tuple[int, int] = (3, 1)


def pocketed(
    name: str, corner: tuple[int, int, int], load: tuple[float, float, float], finer: tuple[int, int] = (3, 1)
) -> PartProblem:
    """Return a box with pockets, held at its bottom and loaded at its top."""
    top = f"nz > 0.99 and z > {BOX - 0.01}"
    problem = iga_nn.Elasticity(**STEEL, fix="nz < -0.99 and z < 0.01", load={top: load})
    part = "xyz"[max(range(3), key=lambda axis: abs(load[axis]))]
    asks = (f"mean u{part} over {top}", f"u{part} at {corner}", "mean von_mises over nx > 0.99")
    return PartProblem(f"cad_mfcad_{name}", problem, asks, finer=finer)


def heatsink() -> PartProblem:
    """Return the heat sink, heated at its bottom; the rest gives heat to the air."""
    air = "z > 0.001 and nz > -0.99"
    problem = iga_nn.Poisson(
        kappa=0.2, source=0.0, conditions=[iga_nn.Flux("nz < -0.99", 0.02), iga_nn.Exchange(air, 5e-5, 25.0)]
    )
    return PartProblem(
        "parts_heatsink", problem, ("max T", "min T", "mean T over nz < -0.99", "T at (30, 25, 5)"), finer=(2, 2)
    )


def two() -> PartProblem:
    """Return the two boxes, each held at its bottom and pushed at its top; one is softer."""
    top = "nz > 0.99"
    names = [f"Open CASCADE STEP translator 7.8 5.{number}" for number in (1, 2)]
    problem = iga_nn.Elasticity(
        young=dict(zip(names, (210000.0, 70000.0), strict=True)),
        poisson_ratio=0.3,
        fix="nz < -0.99",
        load={top: (1.0, 0.0, 0.0)},
    )
    asks = (f"mean ux over {top}", "ux at (50, 10, 10)", "mean von_mises over nx > 0.99", "energy")
    return PartProblem("parts_two", problem, asks, finer=(2, 2))


def ball() -> PartProblem:
    """Return the ball with a source of heat, which it gives to the air."""
    problem = iga_nn.Poisson(source=1.0, kappa=2.0, conditions=[iga_nn.Exchange("x > -99", 0.5, 20.0)])
    return PartProblem("cad_s17o_sphere", problem, ("T at (0, 0, 0)", "mean T", "max T", "energy"))


def scooped() -> PartProblem:
    """Return the box with a part of a ball cut out of its corner, pressed on its top."""
    top = "nz > 0.99"
    problem = iga_nn.Elasticity(**STEEL, fix="nz < -0.99 and z < 0.01", load={"nx > 0.99": (0.0, 10.0, 0.0)})
    asks = (f"mean uy over {top}", "uy at (10, 10, 10)", "mean von_mises over nz > 0.99")
    return PartProblem("cad_s14o_cube_corner_sub_sphere", problem, asks)


def pyramid() -> PartProblem:
    """Return the pyramid on its base under a force in its volume."""
    problem = iga_nn.Elasticity(**STEEL, fix="nz < -0.99", body_force=(1.0, 0.0, -1.0))
    asks = ("ux at (0, 0, 1.4)", "mean ux", "mean von_mises over nx > 0.5")
    return PartProblem("cad_n09o_pyramid", problem, asks)


def wedge() -> PartProblem:
    """Return the wedge with an edge of ten degrees, hot at one face, with a source."""
    problem = iga_nn.Poisson(source=1.0, value={"nz > 0.99": 0.0})
    return PartProblem("cad_n13o_acute_line", problem, ("T at (1, 0, 0)", "mean T", "max T", "energy"))


def octahedron() -> PartProblem:
    """Return the octahedron with a source of heat, held at zero on its upper faces."""
    problem = iga_nn.Poisson(source=1.0, value={"nz > 0.1": 0.0})
    return PartProblem("cad_n14o_octahedron", problem, ("T at (0, 0, 0)", "mean T", "max T", "energy"))


def warmed(label: str, cold: str, heated: str, asks: tuple[str, ...], **how: Any) -> PartProblem:
    """Return a part that is cold on one region, and heated on another."""
    problem = iga_nn.Poisson(source=0.0, conditions=[iga_nn.Value(cold, 0.0), iga_nn.Flux(heated, 1.0)])
    return PartProblem(label, problem, (f"mean T over {heated}", *asks), **how)


def every() -> list[PartProblem]:
    """Return the twenty parts, those of an engineer first."""
    pushed, turned = (10.0, 0.0, 0.0), (0.0, 5.0, -10.0)
    bottom, top = "nz < -0.99 and z < 0.01", f"nz > 0.99 and z > {BOX - 0.01}"
    holes = "abs(nz) < 0.5 and x*x + y*y > 41*41 and x*x + y*y < 54*54"
    hub = "nx*x + ny*y > 30 and x*x + y*y < 1300 and z > 12.01"
    engineers = [
        warmed("parts_bracket", "nx < -0.99 and x < 0.01", "nx > 0.99 and x > 59.9", ("T at (60, 20, 6)", "mean T")),
        warmed("parts_filleted", "nx < -0.99", "nx > 0.99", ("T at (20, 0, 0)",), degree=1, finer=(2, 0)),
        warmed("parts_sheet", "nx < -0.99 and x < 0.01", "nz > 0.99", ("max T", "mean T")),
        two(),
        warmed("parts_void", "nz < -0.99 and z < -19.9", "nz > 0.99 and z > 19.9", ("T at (20, 20, 20)", "mean T")),
        heatsink(),
        warmed("parts_flange", holes, hub, ("max T", "mean T"), finer=(4, 0)),
    ]
    boxes = [
        pocketed("0-0-4-4-19", (10, 10, 10), pushed),
        pocketed("0-0-8-9-19", (5, 5, 10), turned, (4, 0)),
        pocketed("0-0-4-13-19", (10, 10, 10), turned),
        pocketed("0-0-4-7-12-23", (10, 10, 10), pushed),
        warmed("cad_mfcad_0-0-1-10-11-23", bottom, top, ("T at (10, 10, 10)", "mean T"), finer=(4, 0)),
        warmed("cad_mfcad_0-10-11-14-19", bottom, top, ("T at (10, 10, 10)", "mean T")),
    ]
    others = [
        warmed("cad_n10o_qtorus_cyl", "nx < -0.99 and x < 0.01", "ny < -0.99 and y < 0.01", ("max T", "mean T")),
        warmed("cad_i10o_simp", "nz < -0.99 and z < -7.9", "ny > 0.99 and y > 39.9", ("max T", "mean T")),
    ]
    return [*engineers, ball(), scooped(), pyramid(), wedge(), octahedron(), *others, *boxes]
