from __future__ import annotations

from importlib import import_module
from pathlib import Path

from example_files import load_file

import iga_nn
from iga_nn.report.artifacts import ARTIFACTS, figures_of, files_of

DOCS = Path(iga_nn.__file__).resolve().parents[1] / "docs"


def test_the_documentation_shows_the_table_of_files():
    text = (DOCS / "output.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| `") and line.count("|") == 3]
    assert [row.split("`")[1] for row in rows] == [artifact.file for artifact in ARTIFACTS]
    assert load_file(DOCS / "files_table.py").refreshed(text) == text, "`make docs` writes the table anew"


def test_the_table_is_written_anew_and_the_rest_stays():
    refreshed = load_file(DOCS / "files_table.py").refreshed
    text = (DOCS / "output.md").read_text(encoding="utf-8")
    without = "".join(line for line in text.splitlines(keepends=True) if "faces.png` |" not in line)
    assert without != text and refreshed(without) == text


def test_every_file_stands_once_and_every_figure_can_be_drawn():
    names = files_of("report", "map", "solution", "study", "modes")
    assert len(names) == len(set(names))
    for artifact in ARTIFACTS:
        assert bool(artifact.draw) == bool(artifact.takes) == artifact.file.endswith(".png")
        if artifact.draw:
            module, function = artifact.draw.split(".")
            assert callable(getattr(import_module(f"iga_nn.figures.{module}"), function))


def test_a_report_shows_the_figures_of_its_own_sections():
    assert {figure.part for figure in figures_of({"config": {}, "poisson": {}})} == {"map", "solution"}
    assert [figure.file for figure in figures_of({"study": {}})] == ["study.png"]
