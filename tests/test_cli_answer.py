from __future__ import annotations

import pytest

from iga_nn.cli.commands import main
from solve.study import benchmark_volume


def test_a_run_ends_with_the_verdict_the_error_and_what_to_open(formula_training, in_folder, capsys):
    formula_training()
    assert main(["run", "poisson", "cube", "--refine", "0", "1", "--quiet"]) == 0
    verdict, error, opened = capsys.readouterr().out.splitlines()[-3:]
    assert verdict.split(maxsplit=1) == ["verdict", "det J > 0 certified; one-to-one: yes"]
    assert error.startswith("error            relative L2 error ") and "1,331 unknowns" in error
    assert opened.split() == ["open", "cube/report.html"]
    assert (in_folder / "cube" / "report.html").exists()


@pytest.mark.parametrize("amplitude, verdict", [(0.08, "certified"), (0.4, "folded")])
def test_without_a_solve_there_is_no_error(amplitude, verdict, formula_training, in_folder, capsys):
    formula_training(amplitude)
    main(["parameterize", "cube", "--quiet"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[-2:]] == ["verdict", "open"] and verdict in lines[-2]


def test_an_estimate_is_called_one(in_folder, capsys):
    benchmark_volume(4).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--source", "1", "--refine", "0", "--quiet"]) == 0
    assert "error            estimated relative L2 error " in capsys.readouterr().out
