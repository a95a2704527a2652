"""Many surfaces on a cluster
==========================

On one with SLURM: `python examples/slurm.py parts/*.stl --out results --jobs 20`.

Run it on a login node, in a folder that the compute nodes see. Options that it does not know go to `iga-nn batch`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from iga_nn.cli.commands import main as command

THREADS = 4  # of a surface


def slurm_cluster() -> Any:
    """One job a worker, one surface at a time in each; adapt queue, account, hours and memory to your cluster."""
    from dask_jobqueue import SLURMCluster

    return SLURMCluster(
        queue="normal",
        account=None,
        walltime="12:00:00",
        cores=1,  # surfaces at a time in a job; its threads are below
        job_cpu=THREADS,
        memory="6GB",  # a worker that takes more is ended, its surface is tried again and then reported as failed
        job_script_prologue=[f"export OMP_NUM_THREADS={THREADS}", f"export NUMBA_NUM_THREADS={THREADS}"],
        scheduler_options={"dashboard_address": "127.0.0.1:0"},
    )


def main(argv: list[str], cluster: Callable[[], Any] = slurm_cluster) -> int:
    """Start the jobs, run the batch on them, and return its exit code; the jobs end with it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=10, help="so many at a time (default: 10)")
    options, batch = parser.parse_known_args(argv)
    with cluster() as workers:
        workers.adapt(minimum=options.jobs, maximum=options.jobs)  # jobs that reach their walltime are replaced
        return command(["batch", *batch, "--scheduler", workers.scheduler_address])


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
