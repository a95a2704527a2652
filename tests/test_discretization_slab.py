"""Slabs of a trial space: several processes find what one finds."""

import json
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from coarse_rims import coarse_rims
from example_files import load
from mpi_cases import all_coefficients, cases
from mpi_job import mpiexec

from parameterize.spline.bspline import basis_derivatives
from solve import benchmark_volume, solve_problem
from solve.discretization.quadrature import gauss_rule
from solve.discretization.slab import Slab
from solve.discretization.space import TrialSpace, trial_space

REPEATED = np.array([0, 0, 0, 0, 0.2, 0.2, 0.5, 0.5, 0.5, 0.6, 1, 1, 1, 1])
SPACES = {
    "smooth": trial_space(benchmark_volume(9)),
    "linear": trial_space(benchmark_volume(4), degree=1),
    "repeated knots": TrialSpace((3, 3, 3), (REPEATED,) * 3),
}


@pytest.fixture(scope="module")
def alone():
    """Name -> solution of a single process."""
    with pytest.MonkeyPatch.context() as patch:
        coarse_rims(patch.setattr)  # as in the job
        return {name: solve_problem(volume, p, threads=1, **how) for name, (volume, p, how) in cases().items()}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A function that runs groups of so many processes, once, and returns the folder of what they have found."""

    @cache
    def run(processes):
        folder = tmp_path_factory.mktemp("job")
        done = mpiexec(processes, "mpi_cases.py", folder, cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        return folder

    return run


OTHERWISE = ("elasticity", "held")  # one elastic cube: slabs have no multigrid
JOBS = [(3, 3), *(pytest.param(7, ranks, marks=pytest.mark.slow) for ranks in (1, 2, 4, 7))]


@pytest.mark.parametrize(("processes", "ranks"), JOBS)
def test_processes_find_the_solution_of_a_single_one(processes, ranks, alone, job):
    """Of 3 processes one has no span where u has 2; of 7 some have none where it has 3 or 4."""
    folder = job(processes) / str(ranks)
    found = json.loads((folder / "found.json").read_text())
    assert found.pop("refused") == [ranks, ranks, ranks if ranks > 2 else 0]
    assert found.keys() == alone.keys()
    for name, one in alone.items():
        many, alone_found = np.load(folder / f"{name}.npy"), all_coefficients(one)
        assert np.abs(many - alone_found).max() <= 1e-10 * np.abs(alone_found).max(), name
        report = found[name]
        assert len(report.get("memory_mb", [0.0])) == ranks
        assert report["ranks"] == ranks
        assert abs(report["iterations"] - one.report.iterations) <= 1 or name in OTHERWISE, name
        for norm, value in one.report.as_dict().items():
            if norm in ("l2", "l2_relative", "h1_seminorm", "h1_relative", "error_estimate", "h"):
                assert report[norm] == pytest.approx(value, rel=1e-6), (name, norm)
        for role, force in one.report.balance.reactions.items():
            if one.report.balance.is_told:
                assert report["reactions"][role] == pytest.approx(force, rel=1e-6, abs=1e-8), (name, role)
    _counted_as_the_model_says(found, ranks, alone)


def _counted_as_the_model_says(found, ranks, alone):
    """Rows to neighbours exactly, transpositions up to shares that are not equal."""
    halo, transposition = load("benchmarks/mpi").model(8, ranks)
    if ranks == 1:
        assert all("traffic" not in report for report in found.values())
        return
    for name in ("poisson", "started"):
        traffic = found[name]["traffic"]
        assert traffic["halo"] == pytest.approx(halo)
        assert traffic["transposition"] == pytest.approx(transposition, rel=0.15)
    assert found["sheared"]["traffic"]["substitution"] > 0.0


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_every_row_has_an_owner_and_every_point_its_functions(name, ranks):
    space = replace(SPACES[name], dirichlet=("u0", "v0"))
    slabs = [Slab.of(space, SimpleNamespace(size=ranks, rank=rank)) for rank in range(ranks)]
    rows = np.concatenate([np.arange(space.shape[0])[slab.owned[slab.rank]] for slab in slabs])
    assert np.array_equal(rows, np.arange(space.shape[0]))
    points = np.concatenate([gauss_rule(slab).points[0] for slab in slabs])
    assert np.array_equal(points, gauss_rule(space).points[0])
    assert sum(slab.window[0].stop - slab.window[0].start for slab in slabs) == space.shape[0] - 1
    for slab in slabs:
        here = gauss_rule(slab).points[0]
        first, values = basis_derivatives(space.knots[0], space.degrees[0], here)
        mine, same = basis_derivatives(slab.knots[0], slab.degrees[0], here)
        assert np.array_equal(mine + slab.rows.start, first) and np.array_equal(same, values)
        assert slab.elements == space.elements and slab.dofs == space.dofs
