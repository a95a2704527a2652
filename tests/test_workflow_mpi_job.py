"""`iga-nn solve --mpi`: one process prints and writes, and none waits for one that failed."""

import json
import logging
import sys

import numpy as np
import pytest
from mpi_job import mpiexec

from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.options import FiniteOptions
from iga_nn.workflow import mpi_job
from iga_nn.workflow.pipeline import solve_to
from solve import Poisson, SplineField, benchmark_volume, solve_problem

SOLVE = ("mpi_command.py", "solve", "poisson", "map.npz", "--refine", "1", "--mpi", "--quiet")


@pytest.fixture
def folder(tmp_path):
    benchmark_volume(3).save(tmp_path / "map.npz")
    return tmp_path


def _said(done):
    return [line for line in done.stderr.splitlines() if line.startswith(("iga-nn:", "warning:"))]


def test_one_process_prints_and_writes(folder):
    done = mpiexec(2, *SOLVE, "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("unknowns") == 1
    report = json.loads((folder / "out" / "report.json").read_text())
    assert report["command"].endswith("--refine 1 --mpi --out out")
    assert report["poisson"]["levels"][0]["traffic"]["halo"] > 0.0
    found = SplineField.load(folder / "out" / "solution.npz").coefficients
    wanted = solve_problem(benchmark_volume(3), Poisson(), refine=1).coefficients
    assert np.abs(found - wanted).max() <= 1e-10 * np.abs(wanted).max()
    again = mpiexec(2, *SOLVE, "--out", "out", cwd=folder)
    assert again.returncode == 2
    assert _said(again) == ["iga-nn: out: holds a finished result; --force replaces it, --out names another folder"]


class _Others:
    """A communicator whose other processes wait elsewhere."""

    rank, size = 1, 2

    def Dup(self):
        return self

    Ibarrier = Dup

    def Test(self):
        return False

    def Abort(self, code):
        raise SystemExit(code)


@pytest.mark.parametrize(
    ("fault", "says"), [(MemoryError, "MemoryError"), (KeyboardInterrupt, "interrupted"), (OSError("full"), "full")]
)
def test_a_process_that_fails_alone_says_why(fault, says, monkeypatch, capsys):
    for name in ("GRACE", "PRINTING"):
        monkeypatch.setattr(mpi_job, name, 0.0)
    with pytest.raises(SystemExit) as ended, mpi_job.together(_Others()):
        raise fault
    logging.disable(logging.NOTSET)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"iga-nn: process 1 of 2 failed, the job ends: {says}\n"


@pytest.mark.parametrize("how", ["raise", pytest.param("die", marks=pytest.mark.slow)])
def test_a_process_that_fails_ends_the_job(how, folder):
    done = mpiexec(2, *SOLVE, "--out", "out", cwd=folder, IGA_NN_FAIL=how)
    assert done.returncode != 0
    assert done.stderr.strip()  # of mpiexec, and where it is still passed on the process's own line
    assert {path.name for path in (folder / "out").iterdir()} <= {"report.json"}
    json.loads((folder / "out" / "report.json").read_text())


@pytest.mark.slow
def test_more_processes_than_spans_is_a_line(tmp_path):
    benchmark_volume(1).save(tmp_path / "map.npz")
    done = mpiexec(2, *SOLVE[:-3], "0", "--mpi", "--quiet", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert _said(done) == ["warning: spans of u: 1, processes: 2; the others have no work"]


def test_what_does_not_fit_mpi_is_a_line(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(["solve", "poisson", "map.npz", "--mpi", "--device", "cuda"]) == 2
    assert capsys.readouterr().err == "iga-nn: device 'cuda': --mpi runs on the CPU; leave one of them out\n"
    with pytest.raises(InputError, match="solve finite takes its load steps in one process: leave --mpi out"):
        solve_to("map.npz", problem_options=FiniteOptions(), out="out", comm=object())
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    assert main(["solve", "poisson", "map.npz", "--mpi"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iga-nn: --mpi: ") and "install iga-nn[mpi]" in line
