from __future__ import annotations

import asyncio
import csv
import io
import json
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from browser import running
from conftest import formula_parameterization, told
from PIL import Image

import iga_nn
from iga_nn.batch.surfaces import Entry
from iga_nn.batch.table import Batch, Row, page
from iga_nn.cli.answer import batch_exit_code
from iga_nn.options import PoissonOptions
from iga_nn.workflow.worker_run import Ended


def row(name, folder=Path("out"), how=None):
    fresh = Row(Entry(name, f"/parts/{name}", folder / Path(name).stem))
    return fresh if how is None else fresh.ended(how)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of a batch with a finished surface, the cube."""
    folder = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            "parameterize.run.parameterize", lambda *_, when_made, **__: told(formula_parameterization(), when_made)
        )
        patched.setattr("iga_nn.figures.render.can_draw", lambda: False)
        patched.chdir(folder)
        iga_nn.run("poisson", "cube", "out/cube", poisson=PoissonOptions(refine=(0, 1)))
    return folder / "out"


@pytest.fixture
def done(finished, in_folder):
    """The report of the cube, in a copy of its folder."""
    shutil.copytree(finished, "out")
    return json.loads(Path("out/cube/report.json").read_text())


@pytest.fixture
def batch(done):
    folded = json.loads(json.dumps(done))
    folded["parameterization"]["bijective"] = "folded"
    rows = (
        row("b<i>.obj", how=Ended("refused", "/parts/b<i>.obj: not a surface, sorry")),
        row("cube.obj", how=Ended("done", report=done)),
        row("folded.obj", how=Ended("done", report=folded)),
        row("later.obj"),
    )
    return Batch(Path("out"), rows)


def test_a_row_has_the_figures_of_its_report(batch, done):
    figures, quality = batch.rows[1].figures(), formula_parameterization().quality
    assert figures["arap_mean"] == quality.arap.unit_volume.mean
    assert figures["distance_rms"] == quality.relative_distance.rms > 0.0
    assert figures["distance_max"] == quality.relative_distance.max
    finest = done["poisson"]["levels"][-1]
    assert figures["l2_relative"] == finest["l2_relative"] and figures["dofs"] == finest["dofs"] == 11**3
    assert figures["seconds"] == done["seconds"]["total"] and figures["one_to_one"] == "yes"
    assert set(batch.rows[3].figures().values()) == {None}


def test_states_and_counts(batch):
    assert [each.state for each in batch.rows] == ["refused", "certified", "not certified", "waiting"]
    assert batch.summary == "4 surfaces: 1 certified, 1 not certified, 1 refused, 1 waiting"
    assert batch.rows[0].as_line() == "b<i>.obj: refused, not a surface, sorry"
    assert batch.rows[1].as_line().startswith("cube.obj: certified, ARAP mean ")


def test_the_csv_has_all_digits_and_the_json_all_verdicts(batch):
    rows = list(csv.DictReader(io.StringIO(batch.as_csv())))
    assert [each["folder"] for each in rows] == ["b<i>", "cube", "folded", "later"]
    assert float(rows[1]["arap_mean"]) == batch.rows[1].figures()["arap_mean"] and rows[0]["arap_mean"] == ""
    assert rows[0]["line"] == "not a surface, sorry"
    known = batch.as_dict()
    assert known["counts"] == {"certified": 1, "not certified": 1, "refused": 1, "waiting": 1}
    assert known["surfaces"][1]["arap"] == batch.rows[1].report["parameterization"]["arap"]
    assert known["surfaces"][2]["bijective"] == "folded" and "levels" not in known["surfaces"][0]


class Page(HTMLParser):
    """Tags with their attributes, and the text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text += data

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def test_the_page_links_pictures_and_escapes(batch):
    noise = np.random.default_rng(0).integers(0, 255, (466, 600, 3), dtype=np.uint8)
    Image.fromarray(noise).save("out/cube/faces.png")
    text = page(batch)
    found = Page(text)
    assert [link["href"] for link in found.all("a")] == ["cube/report.html"]
    (picture,) = found.all("img")
    assert picture["src"].startswith("data:image/png;base64,") and len(picture["src"]) < 20_000
    assert "not a surface, sorry" in found.text and "<i>" not in text
    assert len(found.all("tr")) == 5 and len(found.all("button")) == 13
    assert not [each for each in found.all("a") + found.all("script") + found.all("link") if "http" in str(each)]


def test_odd_names_on_the_page(done):
    odd = Entry("100%#?.obj", "/parts/100%#?.obj", Path("out/100%#?"))
    odd.folder.mkdir()
    (odd.folder / "report.html").touch()
    found = Page(page(Batch(Path("out"), (Row(odd).ended(Ended("done", report=done)),))))
    assert [link["href"] for link in found.all("a")] == ["100%25%23%3F/report.html"]


def test_a_click_on_a_heading_sorts(chromium, batch, tmp_path):
    file = tmp_path / "batch.html"
    later, sooner = (json.loads(json.dumps(batch.rows[1].report)) for _ in range(2))
    later["seconds"]["total"], sooner["seconds"]["total"] = 1200.0, 0.001
    folded = replace(batch.rows[2], report=sooner)
    second = replace(batch.rows[1], entry=Entry("second.obj", "second.obj", Path("out/second")), report=later)
    rows = (*batch.rows[:2], folded, batch.rows[3], second)
    file.write_text(page(replace(batch, rows=rows)))
    names = "[...document.querySelectorAll('tbody tr')].map((row) => row.cells[1].dataset.value)"

    async def clicked(*headings):
        async with running(chromium, tmp_path) as browser:
            tab = await browser.open(file.as_uri())
            found = []
            for heading in headings:
                await tab.click(heading)
                found.append(await tab.value(names))
            assert tab.complaints == [] and set(tab.asked) <= {file.as_uri()}
        return found

    slow_last, slow_first, by_name = asyncio.run(clicked("seconds", "seconds", "surface"))
    assert slow_last == ["folded.obj", "cube.obj", "second.obj", "b<i>.obj", "later.obj"]  # what is empty last
    assert slow_first == ["second.obj", "cube.obj", "folded.obj", "b<i>.obj", "later.obj"]
    assert by_name == ["b<i>.obj", "cube.obj", "folded.obj", "later.obj", "second.obj"]


@pytest.mark.parametrize(
    ("states", "code"),
    [
        (["certified", "certified"], 0),
        (["certified", "not solved"], 4),
        (["not solved", "not certified"], 3),
        (["not certified", "refused"], 2),
        (["failed", "certified"], 2),
    ],
)
def test_the_exit_code_is_that_of_the_worst_surface(states, code):
    rows = tuple(Row(Entry(state, state, Path(state)), state) for state in states)
    assert batch_exit_code(Batch(Path("out"), rows)) == code
