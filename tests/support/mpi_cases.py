"""Problems that groups of processes of an MPI job solve together: `mpiexec -n 7 python mpi_cases.py FOLDER`.

Of 7 processes 1, 2 and 4 are at work at the same time, then all; 3 are one group.

The first of each group writes, into a folder named after their number, NAME.npy, the coefficients of each problem, and
found.json: the reports, and how many processes raised the error that the data of some of them cause.
"""

import json
import sys
from pathlib import Path

import numpy as np
from coarse_rims import coarse_rims
from cube_grids import plate, two
from rational_shapes import quarter_ring
from volumes import mapped

from parameterize.spline.volume import FACE_NAMES
from solve import Elasticity, ExpressionError, Form, Grading, Poisson, Problem, benchmark_volume, solve_problem

WAVE = "exp(x+z)*sin(y)"


class Wind(Form):
    """Not symmetric: GMRES."""

    symmetric = False

    def flux(self, u, grad, x):
        return grad

    def react(self, u, grad, x):
        return grad[:, 0] + u


def cases():
    """Name -> volume or body, problem and keywords; u has 8 spans, or 4, or 3, or 2; bodies have 8 patches."""
    n4, n3, n2 = (benchmark_volume(spans) for spans in (4, 3, 2))
    mixed = Poisson(
        exact=WAVE,
        kappa="1+y*y",
        reaction="1+x*x",
        robin={"u0": ("2", None), "v1": ("1+x*x", None)},
        neumann={"u1": None, "w0": None},
    )
    coarse = solve_problem(n4, Poisson(exact=WAVE), threads=1)
    body = Elasticity(exact=("exp(x)*sin(y)", "cos(x*z)", "x*y*z"), traction={"u1": None, "v0": None})
    held = Elasticity(
        fix={"nx < -0.5 and y < 0.2": None}, roller="nz > 0.5 and x > 0.4", load={"ny > 0.5": (1, 0, "x")}
    )
    cut = Poisson(exact=WAVE, value="x + z < 0.7", exchange={"ny > 0.5": ("2", None)})
    ring, first = plate(2), plate(1)
    begun = solve_problem(first, Poisson(exact=WAVE), threads=1)
    bent = Elasticity(fix={"nx < -0.5 and y < 1.2": None}, load={"ny > 0.5": (1, 0, "x")}, spring={"nz < -0.5": "2"})
    two_values = Poisson(source="x", value={"nx > 0.5 and y > 0.7": "y"}, exchange={"nz > 0.5": ("2", "z")})
    faces = Poisson(source="1", value={"p0_u0": "y", "p7_v1": "x"}, exchange={"p3_w1": ("2", "1")})
    graded = [Grading.of(own).refined({0: [3] + [0] * (n - 1)}) for own, n in ((n3, 3), (first, 1))]
    sheared = mapped(lambda u, v, w: (u + 3.0 * v, v, w + 1.5 * u))
    return {
        "poisson": (n4, Poisson(exact=WAVE), {"refine": 1}),
        "started": (n4, Poisson(exact=WAVE), {"refine": 1, "start": coarse}),
        "mixed": (n3, mixed, {"refine": 1}),
        "open": (n4, Poisson(exact=WAVE, neumann=dict.fromkeys(FACE_NAMES)), {}),
        "estimated": (n4, Poisson(source="1+x"), {"degree": 2}),
        "linear": (n4, Poisson(exact=WAVE), {"degree": 1}),
        "elasticity": (n2, body, {"tolerance": 1e-13}),
        "rational": (quarter_ring(), Poisson(exact=WAVE), {"degree": 3, "refine": 2}),
        "sheared": (sheared, Poisson(exact=WAVE), {"refine": 1}),
        "held": (n4, held, {"tolerance": 1e-13, "degree": 2}),
        "cut": (n4, cut, {"tolerance": 1e-13}),
        "wind": (n3, Problem(Wind(), exact=WAVE), {}),
        "graded": (n3, Poisson(exact=WAVE), {"grading": graded[0]}),
        "graded plate": (first, Poisson(exact=WAVE), {"grading": graded[1], "tolerance": 1e-13}),
        "plate": (first, Poisson(exact=WAVE), {"refine": 1, "start": begun}),
        "plate with faces": (ring, faces, {"tolerance": 1e-13}),
        "plate with regions": (ring, two_values, {"tolerance": 1e-13}),
        "open plate": (ring, Poisson(exact=WAVE, neumann=dict.fromkeys(FACE_NAMES)), {"tolerance": 1e-13}),
        "bent plate": (ring, bent, {"tolerance": 1e-13, "degree": 2}),
        "windy plate": (first, Problem(Wind(), exact=WAVE), {"tolerance": 1e-13}),
    }


def refused(comm, body):
    """Return how many processes say that kappa is negative, as it is for some of them."""
    try:
        solve_problem(body, Poisson(source="1", kappa="x-0.5"), comm=comm)
    except ExpressionError as error:
        return sum(comm.allgather("kappa must be positive" in str(error)))
    return 0


def too_many(comm):
    """Return how many processes say that two patches are too few for them."""
    try:
        solve_problem(two(), Poisson(source="1"), comm=comm)
    except ValueError as error:
        return sum(comm.allgather(f"patches: 2, processes: {comm.size}" in str(error)))
    return 0


def all_coefficients(solution):
    return np.concatenate([patch.coefficients.ravel() for patch in solution.patches])


def groups(ranks):
    """The sizes of the groups that are at work at the same time, one after the other."""
    return ([1, 2, 4], [7]) if ranks == 7 else ([ranks],)


def main(folder):
    from mpi4py import MPI

    coarse_rims(setattr)
    world = MPI.COMM_WORLD
    for sizes in groups(world.size):
        group = int(np.searchsorted(np.cumsum(sizes), world.rank, side="right"))
        comm = world.Split(group)
        if group < len(sizes):
            (folder / str(comm.size)).mkdir(exist_ok=True)
            solve_all(comm, folder / str(comm.size))


def solve_all(comm, folder):
    found = {}
    for name, (volume, problem, how) in cases().items():
        solution = solve_problem(volume, problem, comm=comm, **how)
        found[name] = solution.report.as_dict() | {"ranks": comm.size}
        coefficients = all_coefficients(solution)
        assert len(set(comm.allgather(coefficients.tobytes()))) == 1
        if comm.rank == 0:
            np.save(folder / f"{name}.npy", coefficients)
    found["refused"] = [refused(comm, benchmark_volume(4)), refused(comm, plate(1)), too_many(comm)]
    if comm.rank == 0:
        (folder / "found.json").write_text(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
