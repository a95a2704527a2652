"""docs/release.md tells what running needs."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import iga_nn

ROOT = Path(iga_nn.__file__).resolve().parents[1]


def test_the_table_has_every_package_of_the_project():
    page = (ROOT / "docs" / "release.md").read_text(encoding="utf-8")
    table = page.split("## What running needs")[1].split("\n## ")[0]
    told = re.findall(r"^\| `([\w-]+)` \|", table, flags=re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert sorted(told) == sorted(re.match(r"[\w-]+", needed)[0] for needed in project["dependencies"])
