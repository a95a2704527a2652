from __future__ import annotations

import pytest
from example_files import cells, load

from parameterize.config import PRESETS, preset

ablation = load("benchmarks/ablation")


def test_the_table_compares_what_used_a_part_with_the_run_with_everything(tmp_path):
    found = {"verdict": "certified", "one_to_one": "yes", "kind": "model"}
    rows = [
        ablation.Row(without="nothing", surface="conch", arap=0.2, distance=1e-4, seconds=10.0, **found),
        ablation.Row(without="race", surface="conch", arap=0.3, distance=2e-4, seconds=5.0, **found),
        ablation.Row(without="nothing", surface="bone", arap=0.5, distance=1e-4, seconds=9.0, **found),
        ablation.Row(without="race", surface="bone", same=True, arap=0.5, distance=1e-4, seconds=9.0, **found),
    ]
    text = ablation.as_text(rows, ablation.Options(("race",), {}, 1, tmp_path))
    (row,) = cells(text, "race")
    assert row[2:] == ["2", "1", "2", "1.500", "2.000", "0.500", "1.50", "2.00"]
    assert "With everything: 2 of 2" in text


def test_steps_after_the_first_stage_are_halved(monkeypatch):
    monkeypatch.setitem(PRESETS, "fast", preset("fast"))
    first, *later = preset("fast").stages
    ablation.PARTS["half the steps"].leave_out()
    halved_first, *halved = preset("fast").stages
    assert halved_first == first
    assert [stage.steps for stage in halved] == [max(1, round(0.5 * stage.steps)) for stage in later]


def test_the_options_without_a_part_hold_while_it_runs():
    """Else what is finished without the part would not be known again, and a second run would be refused."""
    with ablation.options_without("muon"):
        assert preset("fast").train.matrix_rate == 0.0
    assert preset("fast").train.matrix_rate > 0.0
    with ablation.options_without("nothing"):
        assert preset("fast").train.matrix_rate > 0.0


@pytest.mark.parametrize(("given", "said"), [(["--without", "luck"], "no such part"), (["--jobs", "0"], "at least 1")])
def test_bad_arguments_are_one_line(given, said, capsys):
    with pytest.raises(SystemExit):
        ablation.main(given)
    assert said in capsys.readouterr().err
