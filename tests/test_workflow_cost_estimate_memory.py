"""What is said of a solve's memory before it."""

import logging
import tracemalloc
from dataclasses import replace

import pytest
from volumes import mapped

from iga_nn.options import ElasticityOptions, PoissonOptions
from iga_nn.workflow import cost_estimate
from solve import benchmark_volume, solve_with

SHEARED = mapped(lambda u, v, w: (u + 3.0 * v, v, w + 1.5 * u))


@pytest.mark.parametrize(
    ("volume", "statement"),
    [
        (benchmark_volume(24), PoissonOptions(refine=(0,))),
        (benchmark_volume(10, 2), PoissonOptions(refine=(1,), reaction="1", neumann=("u1",))),
        (SHEARED, PoissonOptions(refine=(0, 3))),
        (benchmark_volume(10, 4), PoissonOptions(refine=(0,), quadrature="gauss+1")),
        (benchmark_volume(8), ElasticityOptions(refine=(0, 1), exact="x*y;y;sin(z)")),
    ],
    ids=["poisson", "reaction", "sheared", "degree 4", "elasticity"],
)
def test_a_solve_takes_what_was_said(volume, statement):
    """Within a factor of 1.6: the arrays alone, without those of a first solve that compiles."""
    problem, options = statement.problem(), replace(statement.solve_options(), threads=1)
    said = cost_estimate.solve_memory(volume, problem, options).on(1)
    solve_with(benchmark_volume(3, max(volume.degrees)), problem, replace(options, refine=0))
    tracemalloc.start()
    solve_with(volume, problem, replace(options, tolerance=0.1))
    taken = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    assert taken / 1.6 < said < 1.6 * taken


def test_what_does_not_fit_names_the_processes_that_would(monkeypatch, caplog):
    volume, statement = benchmark_volume(6), PoissonOptions(refine=(0, 5))
    given = volume, statement.problem(), statement.solve_options()
    wanted = cost_estimate.solve_memory(*given)
    for free, named in ((2.0 * wanted.on(1), None), (wanted.on(3), 3), (0.9 * wanted.each_mb, None)):
        monkeypatch.setattr(cost_estimate, "available_memory_mb", lambda _, free=free: free)
        caplog.clear()
        with caplog.at_level(logging.INFO, "iga_nn"):
            cost_estimate.tell_memory(*given)
        said = [record.getMessage() for record in caplog.records]
        assert said[0] == f"estimate: {wanted.on(1) / 1000.0:.1f} GB of memory"
        assert len(said) == 1 + (free < wanted.on(1))
        if named:
            assert f"mpiexec -n {named} iga-nn solve .. --mpi" in said[1]
        else:
            assert not any("mpiexec" in line for line in said)
