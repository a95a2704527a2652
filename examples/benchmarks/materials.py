"""Orthotropic plates and thermal strain: our values beside formulas, CalculiX and FElupe.

    python examples/benchmarks/materials.py --out examples/benchmarks/results

CalculiX (`ccx`) and FElupe are asked where they are installed; otherwise their columns are empty. Each has a box of
quadratic hexahedra of its own. CalculiX takes the material turned, FElupe, whose material lies along x, y, z, a turned
box. Units are mm, N and MPa.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from scipy.sparse import block_diag
from scipy.sparse.linalg import spsolve

import iga_nn
from parameterize.arrays import Array
from parameterize.files import save_text

HEAD = ("case", "quantity", "formula", "ours", "CalculiX", "FElupe")
CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
C3D20 = (*CORNERS, *(tuple((a + b) // 2 for a, b in zip(CORNERS[i], CORNERS[j], strict=True)) for i, j in EDGES))
ANGLE = np.radians(30.0)
CFRP, STEEL = iga_nn.material("CFRP"), iga_nn.material("steel")
WARMER = 100.0
SOFT = 1e-6  # a spring against a motion that no load moves


@dataclass(frozen=True)
class Held:
    """Say which components are zero on the nodes where a condition on x, y, z holds."""

    where: Callable[[Array], Array]  # of points (n, 3): a mask (n,)
    components: tuple[int, ...]


@dataclass(frozen=True)
class Box:
    """State a box of hexahedra for the other programs.

    layers: the material of each layer of elements along z, as lines of CalculiX. traction: of the face at the end of x.
    """

    size: tuple[float, float, float]
    counts: tuple[int, int, int]
    layers: tuple[tuple[str, ...], ...]
    held: tuple[Held, ...]
    traction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    warmer: float = 0.0
    probes: tuple[tuple[float, float, float], ...] = field(default=())


def by_ccx(box: Box) -> Array | None:
    """Return the displacements (probes, 3) of CalculiX; None where it is not installed."""
    program = shutil.which("ccx")
    if program is None:
        return None
    steps = np.array(box.size) / (2 * np.array(box.counts))
    ranges = [range(2 * n + 1) for n in box.counts]
    places = [place for place in product(*ranges) if sum(i % 2 for i in place) < 2]
    number = {place: 1 + i for i, place in enumerate(places)}
    x = np.array(places) * steps
    lines = ["*NODE, NSET=ALL", *(f"{i + 1}, " + ", ".join(f"{c:.12g}" for c in row) for i, row in enumerate(x))]
    elements: dict[int, list[str]] = {k: [] for k in range(len(box.layers))}
    shares = np.zeros(len(x) + 1)
    for e, (i, j, k) in enumerate(product(*(range(n) for n in box.counts)), 1):
        nodes = [number[2 * i + a, 2 * j + b, 2 * k + c] for a, b, c in C3D20]
        layer = k * len(box.layers) // box.counts[2]
        elements[layer] += [f"{e}, " + ", ".join(map(str, nodes[:10])) + ",", ", ".join(map(str, nodes[10:]))]
        if i == box.counts[0] - 1:  # the corners of a quadratic face have -1/12 of its area, the others 1/3
            area = steps[1] * steps[2] * 4
            for node, (a, b, c) in zip(nodes, C3D20, strict=True):
                shares[node] += area * (0.0 if a != 2 else -1.0 / 12.0 if b % 2 == 0 and c % 2 == 0 else 1.0 / 3.0)
    for k, (own, material) in enumerate(zip(elements.values(), box.layers, strict=True)):
        turn = ", ORIENTATION=TURNED" if any("ENGINEERING" in line for line in material) else ""
        lines += [f"*ELEMENT, TYPE=C3D20, ELSET=LAYER{k}", *own, f"*MATERIAL, NAME=M{k}", *material]
        if turn:
            c, s = np.cos(ANGLE), np.sin(ANGLE)
            lines += [f"*ORIENTATION, NAME=TURNED, SYSTEM=RECTANGULAR\n{c}, {s}, 0, {-s}, {c}, 0"]
        lines += [f"*SOLID SECTION, ELSET=LAYER{k}, MATERIAL=M{k}{turn}"]
    for one in box.held:
        nodes = np.flatnonzero(one.where(x)) + 1
        lines += ["*BOUNDARY", *(f"{node}, {c + 1}, {c + 1}, 0" for node in nodes for c in one.components)]
    lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0", "*STEP", "*STATIC"]
    lines += ["*TEMPERATURE", f"ALL, {box.warmer}"] if box.warmer else []
    loads = [(node, c) for node in np.flatnonzero(shares) for c in range(3) if box.traction[c]]
    lines += (
        ["*CLOAD", *(f"{node}, {c + 1}, {shares[node] * box.traction[c]:.12g}" for node, c in loads)] if loads else []
    )
    lines += ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "job"
        path.with_suffix(".inp").write_text("\n".join(lines) + "\n")
        subprocess.run([program, "-i", "job"], cwd=folder, check=True, capture_output=True)
        rows = re.findall(r"^ +(\d+) +(\S+) +(\S+) +(\S+)$", path.with_suffix(".dat").read_text(), re.MULTILINE)
    found = {int(row[0]): [float(value) for value in row[1:]] for row in rows}
    nearest = [int(np.argmin(np.linalg.norm(x - probe, axis=1))) for probe in np.array(box.probes)]
    return np.array([found[1 + node] for node in nearest])


def by_felupe(box: Box) -> Array | None:
    """Return the displacements (probes, 3) of FElupe for fibres at an angle; None where it is not installed."""
    try:
        import felupe
    except ImportError:
        return None
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    along = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # rows: the fibres' axes
    cube = felupe.Cube(b=box.size, n=tuple(n + 1 for n in box.counts))
    mesh = felupe.mesh.convert(cube, order=2, calc_points=True, calc_midfaces=True, calc_midvolumes=True)
    x = mesh.points.copy()
    turned = felupe.Mesh(x @ along.T, mesh.cells, mesh.cell_type)
    body_field = felupe.FieldContainer([felupe.Field(felupe.RegionTriQuadraticHexahedron(turned), dim=3)])
    (e1, e2, e3), (nu12, nu13, nu23), (g12, g13, g23) = CFRP.young, CFRP.poisson_ratio, CFRP.shear_modulus
    law = felupe.LinearElasticOrthotropic(E=[e1, e2, e3], nu=[nu12, nu23, nu13 * e3 / e1], G=[g12, g23, g13])
    solid = felupe.SolidBody(law, body_field)
    stiff, points = solid.assemble.matrix().tocsr(), len(x)
    blocks = block_diag([along] * points, format="csr")  # from x, y, z to the fibres' axes
    stiff = blocks.T @ stiff @ blocks
    force = np.zeros((points, 3))
    weight = {0.0: 1.0 / 6.0, 1.0: 4.0 / 6.0}  # of a quadratic edge: at its ends and in its middle
    for i, (_, y, z) in enumerate(x):
        if np.isclose(x[i, 0], box.size[0]):
            share = 1.0
            for value, length, n in ((y, box.size[1], box.counts[1]), (z, box.size[2], box.counts[2])):
                place = round(value / length * 2 * n)
                share *= length / n * weight[float(place % 2)] * (1 if place % 2 or place in (0, 2 * n) else 2)
            force[i] = share * np.array(box.traction)
    fixed = np.zeros((points, 3), dtype=bool)
    for one in box.held:
        fixed[np.ix_(one.where(x), one.components)] = True
    free = np.flatnonzero(~fixed.ravel())
    u = np.zeros(3 * points)
    u[free] = spsolve(stiff[free][:, free].tocsc(), force.ravel()[free])
    nearest = [int(np.argmin(np.linalg.norm(x - probe, axis=1))) for probe in np.array(box.probes)]
    return u.reshape(-1, 3)[nearest]


def engineering(one: iga_nn.Material) -> tuple[str, ...]:
    """Return the lines of an orthotropic material for CalculiX."""
    constants = [*one.young, *one.poisson_ratio, *one.shear_modulus]
    return (
        "*ELASTIC, TYPE=ENGINEERING CONSTANTS",
        ", ".join(f"{value:.12g}" for value in constants[:8]) + ",",
        f"{constants[8]:.12g}",
    )


def isotropic(young: float, nu: float, expansion: float) -> tuple[str, ...]:
    """Return the lines of an isotropic material for CalculiX."""
    return "*ELASTIC", f"{young}, {nu}", "*EXPANSION, ZERO=0", f"{expansion}"


def bar(size: tuple[float, float, float], base: float = 0.0) -> iga_nn.BSplineVolume:
    """Return a box that begins at the origin, or at a height."""
    a, b, c = size
    points = [[[[a * i, b * j, base + c * k] for k in (0, 1)] for j in (0, 1)] for i in (0, 1)]
    return iga_nn.BSplineVolume.uniform(points, degree=1)


def at(axis: int, value: float) -> Callable[[Array], Array]:
    """Return the condition that a coordinate has a value."""
    return lambda x: np.isclose(x[:, axis], value)


def off_axis() -> list[list[str]]:
    """Return the row of a bar whose fibres lie at 30 degrees to its pull (Jones 1999, equation 2.97)."""
    size, end, pull = (40.0, 5.0, 1.0), (40.0, 0.0, 0.0), 100.0
    (e1, e2, _), nu, shear = CFRP.young, CFRP.poisson_ratio[0], CFRP.shear_modulus[0]
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    exact = pull * 40.0 * (c**4 / e1 + (1 / shear - 2 * nu / e1) * s**2 * c**2 + s**4 / e2)
    first = (float(c), float(s), 0.0)
    law = iga_nn.Elasticity(
        material=CFRP, first_axis=first, roller=("u0", "w0"), load={"u1": (pull, 0, 0)}, spring={"v0": SOFT}
    )
    ours = iga_nn.solve(bar(size), law, degree=2).probe([end])[0, 0]
    held = Held(at(0, 0.0), (0,)), Held(at(2, 0.0), (2,)), Held(lambda x: np.abs(x).max(axis=1) < 1e-9, (1,))
    box = Box(size, (8, 2, 1), (engineering(CFRP),), held, (pull, 0.0, 0.0), probes=(end,))
    return [row("bar, fibres at 30°", "u_x of the end", exact, ours, by_ccx(box), by_felupe(box), 0)]


def plate() -> list[list[str]]:
    """Return the row of a clamped plate whose fibres lie at 30 degrees, bent by a load at its end."""
    size, end, load = (20.0, 10.0, 1.0), (20.0, 10.0, 0.5), 0.1
    first = (float(np.cos(ANGLE)), float(np.sin(ANGLE)), 0.0)
    law = iga_nn.Elasticity(material=CFRP, first_axis=first, fix="u0", load={"u1": (0, 0, load)})
    ours = iga_nn.solve(bar(size), law, degree=4, refine=3).probe([end])[0, 2]
    box = Box(size, (20, 10, 2), (engineering(CFRP),), (Held(at(0, 0.0), (0, 1, 2)),), (0.0, 0.0, load), probes=(end,))
    return [row("clamped plate, fibres at 30°", "u_z of a corner", None, ours, by_ccx(box), by_felupe(box), 2)]


def heated() -> list[list[str]]:
    """Return the rows of a steel block held at one face, and of a bar held at both ends, both heated."""
    size, corner = (10.0, 10.0, 10.0), (10.0, 10.0, 10.0)
    law = iga_nn.Elasticity(material=STEEL, temperature_change=WARMER, fix="u0")
    ours = iga_nn.solve(bar(size), law, degree=3, refine=2).probe([corner])[0, 0]
    lines = (isotropic(STEEL.young, STEEL.poisson_ratio, STEEL.expansion),)
    box = Box(size, (8, 8, 8), lines, (Held(at(0, 0.0), (0, 1, 2)),), warmer=WARMER, probes=(corner,))
    held = iga_nn.Elasticity(material=STEEL, temperature_change=WARMER, roller=("u0", "u1", "v0", "w0"))
    stress = iga_nn.solve(bar((40.0, 5.0, 1.0)), held, degree=2).quantity("stress", [[0.5, 0.5, 0.5]])[0, 0, 0]
    return [
        row("steel block, clamped, 100 K warmer", "u_x of a corner", None, ours, by_ccx(box), None, 0),
        row("steel bar, held at both ends, 100 K warmer", "σ_xx", -STEEL.young * STEEL.expansion * WARMER, stress),
    ]


def bimetal() -> list[list[str]]:
    """Return the row of the curvature of a strip of two metals (Timoshenko, J. Opt. Soc. Am. 11 (1925) 233)."""
    size = (12.0, 1.0, 1.0)
    exact = 6e-5 * WARMER * 4.0 / (2.0 * (12.0 + 1.5 * 3.0))
    strip = iga_nn.Body.from_patches([bar(size), bar(size, 1.0)])
    law = iga_nn.Elasticity(
        young={0: 100.0, 1: 200.0},
        poisson_ratio=0.0,
        expansion={0: 2e-5, 1: 1e-5},
        temperature_change=WARMER,
        roller=("u0", "p0_v0", "p1_v0"),
        spring={"w0 and x < 1": SOFT},
    )
    probes = tuple((x, 0.5, 1.0) for x in (0.0, 3.0, 6.0))
    ours = iga_nn.solve(strip, law, degree=3, refine=2).probe(probes)
    held = Held(at(0, 0.0), (0,)), Held(at(1, 0.0), (1,)), Held(lambda x: np.abs(x - [0, 0, 1]).max(1) < 1e-9, (2,))
    lines = isotropic(100.0, 0.0, 2e-5), isotropic(200.0, 0.0, 1e-5)
    theirs = by_ccx(Box((12.0, 1.0, 2.0), (24, 2, 8), lines, held, warmer=WARMER, probes=probes))

    def bent(u: Array | None) -> Array | None:
        return None if u is None else np.array([[(u[2, 2] - 2.0 * u[1, 2] + u[0, 2]) / 9.0]])

    ours_bent = bent(ours)
    assert ours_bent is not None
    return [row("strip of two metals, 100 K warmer", "curvature", exact, ours_bent[0, 0], bent(theirs), None, 0)]


def row(
    case: str,
    quantity: str,
    exact: float | None,
    ours: float,
    ccx: Array | None = None,
    felupe: Array | None = None,
    component: int = 0,
) -> list[str]:
    """Return a row of the table."""
    others = (None if own is None else own[0, component] for own in (ccx, felupe))
    return [case, quantity, *("–" if value is None else f"{value:.5g}" for value in (exact, ours, *others))]


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path())
    arguments = parser.parse_args()
    rows = [*off_axis(), *plate(), *heated(), *bimetal()]
    table = [" | ".join(("", *cells, "")).strip() for cells in (HEAD, ["---"] * len(HEAD), *rows)]
    print("\n".join(table))
    save_text(arguments.out / "materials.md", "\n".join(["# Materials: other programs and formulas", "", *table, ""]))


if __name__ == "__main__":
    main()
