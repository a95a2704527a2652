"""The site is built without a warning; its links lead somewhere, it fetches nothing, and it shows what is public."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from documents import ROOT, documented_names

LOADED = {"img": "src", "script": "src", "iframe": "src", "link": "href", "source": "src"}  # without a click
NOT_LOADED = ("next", "prev", "index", "search", "genindex", "canonical")  # kinds of <link>


class Page(HTMLParser):
    """The places of a page, what it links to, and what it loads."""

    def __init__(self, file: Path):
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.formulas = 0
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.places |= {given[key] for key in ("id", "name") if given.get(key)}
        self.formulas += tag == "math"
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if given.get(LOADED.get(tag, "")) and given.get("rel") not in NOT_LOADED:
            self.loads.append(given[LOADED[tag]])


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages of the site, built in a copy: the gallery writes beside its sources.

    Of the scripts heat.py alone is run here, and draws nothing: test_examples.py runs them all.
    """
    copy = tmp_path_factory.mktemp("site")
    for folder in ("docs", "examples"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("_build", "gallery", "out"))
    for file in ROOT.glob("*.md"):
        shutil.copy(file, copy)
    build = [sys.executable, "-P", "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    build += ["-D", r"sphinx_gallery_conf.filename_pattern=/heat\.py$"]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "VTK_DEFAULT_OPENGL_WINDOW": "none"}
    done = subprocess.run(
        [*build, copy / "docs", copy / "html"], cwd=copy, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return {file: Page(file) for file in sorted((copy / "html").rglob("*.html")) if "_static" not in file.parts}


def test_every_link_leads_to_a_page_and_a_place(site):
    broken = []
    for file, page in site.items():
        for address in [*page.links, *(urlsplit(load)._replace(fragment="").geturl() for load in page.loads)]:
            parts = urlsplit(address)
            if parts.scheme or not address.strip("#"):
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            found = target.exists() and (
                not parts.fragment or target not in site or parts.fragment in site[target].places
            )
            broken += [] if found else [f"{file.name}: {address}"]
    assert broken == []
    assert sum(len(page.links) for page in site.values()) > 1000


def test_no_page_loads_anything_from_elsewhere(site):
    loads = [address for page in site.values() for address in page.loads]
    assert [address for address in loads if urlsplit(address).scheme not in ("", "data") or address[:2] == "//"] == []


def test_formulas_and_public_names_are_shown(site):
    by_name = {file.name: page for file, page in site.items()}
    assert by_name["method.html"].formulas > 50 and by_name["solver.html"].formulas > 50
    assert set(documented_names()) <= set().union(*(page.places for page in site.values()))
    text = "".join(file.read_text(encoding="utf-8") for file in site if file.parent.name == "api")
    assert "ArrayLike" in text and "_SupportsArray" not in text and "ForwardRef" not in text


def test_a_script_that_is_run_shows_what_it_says_and_every_volume_is_shown(site):
    (heat,) = (file for file in site if file.parts[-2:] == ("gallery", "heat.html"))
    assert "relative error" in heat.read_text(encoding="utf-8")
    views = {f"scenes/{file.name}" for file in site if file.parent.name == "scenes"}
    assert views == {f"scenes/{name}.html" for name in ("heat", "first_run", "given_corners", "own_mesh")}
    assert views <= {urlsplit(load).path.removeprefix("../") for page in site.values() for load in page.loads}


def test_every_page_of_the_guide_shows_a_picture_or_code(site):
    for file in (ROOT / "docs").rglob("*.md"):
        if "_build" in file.parts or file.parent.name == "api" or file.stem in ("contributing", "changelog"):
            continue
        text = file.read_text(encoding="utf-8")
        assert "```{image}" in text or "```sh" in text or "```python" in text or "```text" in text, file.name
