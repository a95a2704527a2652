from __future__ import annotations

from pathlib import Path

from iga_nn import figures
from iga_nn.report.artifacts import ARTIFACTS, figures_of, files_of

ROOT = Path(figures.__file__).resolve().parents[2]


def test_the_documentation_shows_the_table_of_files():
    rows = ["| file | content |", "| --- | --- |"]
    for artifact in ARTIFACTS:
        arrays = ": " + ", ".join(f"`{name}`" for name in artifact.arrays) if artifact.arrays else ""
        rows.append(f"| `{artifact.file}` | {artifact.shows}{arrays} |")
    assert "\n".join(rows) in (ROOT / "docs" / "output.md").read_text(encoding="utf-8")


def test_every_file_stands_once_and_every_figure_can_be_drawn():
    names = files_of("report", "map", "solution", "study")
    assert len(names) == len(set(names))
    for artifact in ARTIFACTS:
        assert bool(artifact.draw) == bool(artifact.takes) == artifact.file.endswith(".png")
        assert not artifact.draw or artifact.draw in figures.__all__


def test_a_report_shows_the_figures_of_its_own_sections():
    assert {figure.part for figure in figures_of({"config": {}, "poisson": {}})} == {"map", "solution"}
    assert [figure.file for figure in figures_of({"study": {}})] == ["study.png"]
