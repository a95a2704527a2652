from __future__ import annotations

import csv
import os
from pathlib import Path
from types import SimpleNamespace

import dask
import pytest
from distributed import LocalCluster
from example_files import load
from mesh_files import obj
from small_run import BATCH_WORKER, small_surface

from iga_nn.batch import cluster
from iga_nn.errors import InputError
from iga_nn.options import WorkerOptions


@pytest.mark.parametrize(
    ("text", "limit"), [("4GiB", 4 << 30), ("2 GB", 2_000_000_000), ("0", 0), ("536870912", 1 << 29)]
)
def test_memory_limits_are_read(text, limit):
    assert cluster.memory_limit(WorkerOptions(memory_limit=text)) == limit


@pytest.mark.parametrize("text", ["", "4 apples", "-1GiB", "511MiB", "nan", "inf", "1e400"])
def test_memory_limits_that_mean_nothing(text):
    with pytest.raises(InputError, match="memory limit"):
        cluster.memory_limit(WorkerOptions(memory_limit=text))


def test_the_environment_is_left_as_it_was():
    before = dict(os.environ)
    with cluster._environment({"OMP_NUM_THREADS": "3"}):
        assert os.environ["OMP_NUM_THREADS"] == "3"
        os.environ["MALLOC_TRIM_THRESHOLD_"] = "65536"  # as dask does
    assert dict(os.environ) == before


def test_workers_that_never_come_are_not_waited_for_without_end(monkeypatch):
    monkeypatch.setattr(cluster, "HOPELESS", -1.0)
    nobody = SimpleNamespace(subscribe_topic=lambda *_: None, nthreads=dict)
    with pytest.raises(InputError, match="do not start again"):
        next(cluster.computed(nobody, [None], WorkerOptions(), lambda *_: None))


@pytest.mark.slow
def test_the_slurm_script_runs_a_batch_on_the_workers_of_a_cluster(in_folder):
    surface = small_surface()
    Path("pillow.obj").write_text(obj(surface.vertices, surface.faces))
    preload = {"distributed.worker.preload": [str(BATCH_WORKER)]}
    with cluster._environment({}), dask.config.set(preload | {"temporary-directory": str(in_folder)}):
        code = load("slurm").main(
            ["pillow.obj", "nowhere.obj", "--out", "out", "--jobs", "1", "--refine", "0", "--quiet"],
            lambda: LocalCluster(
                n_workers=0, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs="CRITICAL"
            ),
        )
    assert code == 2
    with Path("out/batch.csv").open(newline="") as stream:
        done, refused = csv.DictReader(stream)
    assert done["state"] in ("certified", "not certified", "not the part") and Path("out/pillow/volume.npz").is_file()
    assert refused["line"] == "no such file: check the name and the folder"


def test_a_job_takes_one_surface_at_a_time():
    pytest.importorskip("dask_jobqueue")
    with load("slurm").slurm_cluster() as jobs:
        script = jobs.job_script()
    assert "#SBATCH --cpus-per-task=4" in script and "export OMP_NUM_THREADS=4" in script
    assert "--nthreads 1" in script and "--nanny" in script and "#SBATCH --mem=6G" in script
