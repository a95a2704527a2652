"""A plate with four holes in tension: blocks of splines beside fine quadratic tetrahedra.

    python examples/benchmarks/plate_fem.py --out examples/benchmarks/results
    python examples/benchmarks/plate_fem.py --volume out/handles/plate_4/volume.npz

The plate is plate_4 of machined_shapes.py, held at its left end and pulled at its right one by a force of 1. The
finite elements are those of scikit-fem on meshes of gmsh (`pip install scikit-fem gmsh`; neither is a part of this
project), on a quarter of the plate: the two other planes of symmetry cut it. Two plates are meshed: with holes of 24
flat sides, as the surface has them, and with round ones. At the corners of flat sides the stress has no bound, and its
largest value grows with each refinement; over two flat sides its mean converges. The curves of the splines run through
these corners and are round between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from machined_shapes import plate_4
from processes import OneLineParser, as_markdown

import iga_nn
from parameterize import surface_from_arrays
from parameterize.files import save_text
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.surface.geometry import normals_and_areas
from solve import Solution

if TYPE_CHECKING:
    import skfem

HALF, HEIGHT = (3.0, 2.0), 0.8  # of the plate: half its length and width, its thickness
HOLE, RADIUS, SIDES = (2.0, 1.0), 0.45, 24  # the hole in its first quadrant
FORCE = 1.0
LAW = {"young": 1.0, "poisson_ratio": 0.3}
HELD, PULLED = "x < -2.95 and nx < -0.7", "x > 2.95 and nx > 0.7"
TOP = 75.0, 105.0  # degrees around a hole, from the pull on: the flat sides where the stress along it is largest
MESHES = (0.4, 0.15), (0.25, 0.07), (0.25, 0.035)  # sizes of tetrahedra far from the holes, and at them
SLOPE = 0.35  # by which the size grows with the distance from a hole
AT_WALL = 0.03  # how far a point of a hole's wall may lie from the circle
HEAD = ("solution", "unknowns", "energy", "displacement", "stress, left hole", "right hole", "largest, left", "right")
DIFFERENCES = (("to the flat sides", slice(0, 4)), ("to the round holes", slice(0, 6)))


@dataclass(frozen=True)
class Figures:
    """What is compared, of a force of 1.

    energy: of the strain. displacement: the mean of the pulled end, along the pull. left, right: the stress along the
    plate at the top of the hole near either end, its mean over the thickness and two flat sides. left_most, right_most:
    its largest value there.
    """

    energy: float
    displacement: float
    left: float
    right: float
    left_most: float
    right_most: float


def top_of(x: np.ndarray, side: float) -> np.ndarray:
    """Return which points (2 or 3, ...) on a hole's wall lie at its top, away from the middle of the plate."""
    angle = np.degrees(np.arctan2(np.abs(x[1]) - HOLE[1], x[0] - side * HOLE[0]))
    return (angle > TOP[0]) & (angle < TOP[1])


def at_wall(x: np.ndarray, side: float) -> np.ndarray:
    """Return which points (2 or 3, ...) lie on the wall of a hole, of the left end (-1) or the right one (1)."""
    away = np.hypot(x[0] - side * HOLE[0], np.abs(x[1]) - HOLE[1])
    return np.abs(away - RADIUS) < AT_WALL


# Splines


def of_splines(body: iga_nn.Body, refine: int) -> tuple[int, Figures]:
    """Return the unknowns and the figures of a solve on blocks."""
    law = iga_nn.Elasticity(**LAW, fix=HELD, load={PULLED: (1.0, 0.0, 0.0)})
    solution = iga_nn.solve(body, law, refine=refine, tolerance=1e-8, estimate=False)
    balance = solution.report.balance
    (area,) = (found for name, found in balance.areas.items() if name.startswith("load"))
    scale = FORCE / balance.load[0]
    moved = float(iga_nn.integrate(solution, "u", over=PULLED)[0]) / area
    energy = iga_nn.integrate(
        solution, lambda u, grad, x: 0.5 * np.einsum("ab...,ab...->...", law.flux(u, grad, x), grad)
    )
    means = [wall_of_splines(solution, side) for side in (-1.0, 1.0)]
    figures = [float(energy) * scale**2, moved * scale]
    return solution.report.dofs, Figures(*figures, *(scale * one[k] for k in (0, 1) for one in means))


def wall_of_splines(solution: Solution, side: float) -> tuple[float, float]:
    """Return mean and maximum of the stress along the plate at the tops of the two holes near an end."""
    boundary = SampledBoundary.of(solution.geometry)
    corners = boundary.triangles
    middles = boundary.points[corners].mean(axis=1)
    normals, areas = normals_and_areas(boundary.points, corners)
    chosen = np.flatnonzero(at_wall(middles.T, side) & top_of(middles.T, side) & (np.abs(normals[:, 2]) < 0.5))
    stress = np.empty(len(chosen))
    for number, patch in enumerate(solution.patches):
        own = boundary.patches[corners[chosen, 0]] == number
        places = boundary.parameters[corners[chosen[own]]].mean(axis=1)
        stress[own] = patch.quantity("stress", places)[:, 0, 0] if own.any() else []
    return float(np.average(stress, weights=areas[chosen])), float(stress.max())


# Finite elements


def of_elements(far: float, near: float, sides: int) -> tuple[int, Figures]:
    """Return the unknowns and the figures of quadratic tetrahedra of two sizes; 0 sides for round holes."""
    import skfem
    from scipy.sparse.linalg import LinearOperator, cg
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = quarter(far, near, sides)
    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, element, intorder=4)
    lam, mu = lame_parameters(LAW["young"], LAW["poisson_ratio"])
    stiffness = skfem.asm(linear_elasticity(lam, mu), basis)
    end = skfem.FacetBasis(
        mesh, element, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], HALF[0])), intorder=4
    )
    area = 2.0 * HALF[1] * HEIGHT
    load = skfem.LinearForm(lambda v, w: FORCE / area * v[0]).assemble(end)
    free = basis.complement_dofs(*held_unknowns(basis))
    matrix = stiffness[free][:, free].tocsr()
    diagonal = LinearOperator(matrix.shape, lambda r: r / matrix.diagonal())
    u = np.zeros(basis.N)
    u[free], failed = cg(matrix, load[free], rtol=1e-9, maxiter=20_000, M=diagonal)
    assert not failed, "conjugate gradients"

    def wall(side: float) -> tuple[float, float]:
        facets = mesh.facets_satisfying(lambda x: at_wall(x, side), boundaries_only=True)
        there = skfem.FacetBasis(mesh, element, facets=facets, intorder=4)
        grad = np.asarray(there.interpolate(u).grad)
        stress = lam * (grad[0, 0] + grad[1, 1] + grad[2, 2]) + 2.0 * mu * grad[0, 0]
        chosen = top_of(np.asarray(there.global_coordinates()), side)
        return float(np.average(stress[chosen], weights=there.dx[chosen])), float(stress[chosen].max())

    means = wall(-1.0), wall(1.0)
    work = 4.0 * float(load @ u)  # of four quarters
    return basis.N, Figures(0.5 * work, work / FORCE, *(one[k] for k in (0, 1) for one in means))


def held_unknowns(basis: skfem.Basis) -> Iterator[np.ndarray]:
    """Yield the unknowns that the held end and the two planes of symmetry fix."""
    for component in range(3):
        yield basis.get_dofs(lambda x: np.isclose(x[0], -HALF[0])).all(f"u^{component + 1}")
    yield basis.get_dofs(lambda x: np.isclose(x[1], 0.0)).all("u^2")
    yield basis.get_dofs(lambda x: np.isclose(x[2], 0.5 * HEIGHT)).all("u^3")


def quarter(far: float, near: float, sides: int) -> skfem.Mesh:
    """Return the tetrahedra of the quarter of the plate with y > 0 below half its height, curved at round holes."""
    import gmsh
    import skfem

    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        shape = gmsh.model.occ
        plate = shape.addBox(-HALF[0], 0.0, 0.0, 2.0 * HALF[0], HALF[1], 0.5 * HEIGHT)
        shape.cut([(3, plate)], [(3, bore(side * HOLE[0], sides)) for side in (-1.0, 1.0)])
        shape.synchronize()
        for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{name}", 0)

        def size(dim: int, tag: int, x: float, y: float, z: float, proposed: float) -> float:
            away = abs(np.hypot(abs(x) - HOLE[0], y - HOLE[1]) - RADIUS)
            return min(far, near + SLOPE * float(away))

        gmsh.model.mesh.setSizeCallback(size)
        gmsh.option.setNumber("Mesh.ElementOrder", 1 if sides else 2)
        gmsh.model.mesh.generate(3)
        tags, points, _ = gmsh.model.mesh.getNodes()
        _, _, (nodes,) = gmsh.model.mesh.getElements(3)
    finally:
        gmsh.finalize()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    used, cells = np.unique(number[nodes], return_inverse=True)
    places, cells = points.reshape(-1, 3)[used].T.copy(), cells.reshape(-1, 4 if sides else 10)
    if sides:
        return skfem.MeshTet(places, cells.T.copy())
    return skfem.MeshTet2(places, cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]].T.copy())  # gmsh's last two edges come first


def bore(x: float, sides: int) -> int:
    """Return the tag of the solid that is cut out for a hole."""
    import gmsh

    shape = gmsh.model.occ
    if not sides:
        return shape.addCylinder(x, HOLE[1], 0.0, 0.0, 0.0, HEIGHT, RADIUS)
    angles = 2.0 * np.pi * np.arange(sides) / sides
    corners = [shape.addPoint(x + RADIUS * np.cos(a), HOLE[1] + RADIUS * np.sin(a), 0.0) for a in angles]
    lines = [shape.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    face = shape.addPlaneSurface([shape.addCurveLoop(lines)])
    return next(tag for dim, tag in shape.extrude([(2, face)], 0.0, 0.0, HEIGHT) if dim == 3)


# Table


def main(argv: list[str] | None = None) -> int:
    """Print the table, and write it where --out names a folder."""
    parser = OneLineParser(prog="plate_fem.py", description=__doc__.splitlines()[0])
    parser.add_argument("--volume", type=Path, help="the map, as handles.py leaves it (default: made here)")
    parser.add_argument("--levels", type=int, default=2, help="of the splines: each halves all spans (default: 2)")
    parser.add_argument("--out", type=Path, help="folder of the table")
    given = parser.parse_args(argv)
    if given.volume:
        body = iga_nn.load_volume(given.volume)
    else:
        body = iga_nn.parameterize(surface_from_arrays(*plate_4(), "plate_4")).volume
    table: list[list[str]] = []

    def add(name: str, unknowns: int, figures: Figures) -> Figures:
        table.append([name, f"{unknowns:,}", *(f"{value:.4g}" for value in astuple(figures))])
        print(" | ".join(table[-1]), flush=True)
        return figures

    for far, near in MESHES:
        flat = add(f"tetrahedra of {near:g} at {SIDES} flat sides", *of_elements(far, near, SIDES))
    for far, near in MESHES:
        circle = add(f"tetrahedra of {near:g} at round holes", *of_elements(far, near, 0))
    for level in range(given.levels):
        ours = add(f"splines, level {level}", *of_splines(body, level))
    for (words, columns), theirs in zip(DIFFERENCES, (flat, circle), strict=True):
        shares = [100.0 * (a / b - 1.0) for a, b in zip(astuple(ours), astuple(theirs), strict=True)]
        shown = [f"{share:+.2f} %" if k in range(6)[columns] else "" for k, share in enumerate(shares)]
        table.append([f"difference {words}", "", *shown])
        print(" | ".join(table[-1]), flush=True)
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "plate_fem.md", as_markdown(HEAD, table) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
