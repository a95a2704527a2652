from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from example_files import cells, load

from iga_nn.options import MapOptions

cad = load("benchmarks/cad")


def options(folder, *parts, **given):
    return cad.Options(parts, MapOptions(device="cpu", **given), 1, Path(folder))


def test_the_table_has_a_row_a_part(tmp_path):
    ring = cad.Row(
        "cylinder",
        faces=96,
        blocks=1,
        verdict="certified",
        one_to_one="yes",
        distance_max=8e-4,
        edge_rms=7.8e-5,
        edge_max=4.76e-4,
        normals_mean=0.731,
        seconds=27.8,
        origin="sharp",
    )
    refused = cad.Row("shaft", "too thin")
    text = cad.as_text([ring, refused], options(tmp_path, "cylinder", "shaft", "tee", control_points=20))
    assert cells(text, "cylinder") == [
        ["cylinder", "96", "1", "sharp", "certified", "yes", "8.0e-04", "7.8e-05", "4.8e-04", "0.73", "28"]
    ]
    assert cells(text, "shaft")[0][4] == "too thin"
    assert "Certified and one-to-one 1 of 2." in text and "Not finished yet: 1 of 3" in text
    assert "20 control points" in text


@pytest.mark.slow
def test_an_exact_part_is_run_and_kept(tmp_path, in_this_process, capsys):
    assert cad.main(["--only", "tee", "--out", str(tmp_path)]) == 0
    assert "| tee |" in capsys.readouterr().out
    (row,) = csv.DictReader((tmp_path / "cad.csv").open())
    report = json.loads((tmp_path / "tee" / "report.json").read_text())
    assert row["verdict"] == "certified" and row["blocks"] == "4" and float(row["edge_max"]) < 1e-12
    assert report["input"]["faces"] == int(row["faces"])


@pytest.mark.parametrize(("given", "said"), [(["--only", "ball"], "no such part"), (["--jobs", "0"], "at least 1")])
def test_bad_arguments_are_one_line(given, said, capsys):
    with pytest.raises(SystemExit):
        cad.main(given)
    assert said in capsys.readouterr().err
