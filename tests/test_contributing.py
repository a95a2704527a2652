"""CONTRIBUTING.md and the files beside it name what is there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import iga_nn

ROOT = Path(iga_nn.__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
MOST_WORDS = 1000


def test_every_path_exists():
    paths = set(
        re.findall(r"`((?:[\w.-]+/)+[\w.-]*|[\w.-]+\.(?:toml|md|yaml))`|(tests/\S+\.py)$", TEXT, flags=re.MULTILINE)
    )
    named = {first or second for first, second in paths}
    assert len(named) > 25
    missing = [path for path in sorted(named) if not (ROOT / path).exists()]
    assert [path for path in missing if not path.startswith("docs/_build/")] == []  # `make docs` builds it


def test_every_floor_is_one_of_the_linter():
    """The picture shows the floors of `pyproject.toml` in their order, top floor first."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    floors = {c["containers"][0]: " | ".join(c["layers"]).split(" | ") for c in contracts if "containers" in c}
    package, seen = "", []
    for line in re.findall(r"```\n(.*?)```", TEXT, flags=re.DOTALL)[0].splitlines():
        start, names = line[:16].strip(), line[16:33]
        package, seen = (start, []) if start in floors else (package, seen)
        for name in filter(None, names.strip().split(", ")):
            assert (ROOT / package / name).exists() or (ROOT / package / f"{name}.py").exists(), name
            seen.append(floors[package].index(name))
            assert seen == sorted(seen), name


def test_every_target_of_make_exists():
    makefile = (ROOT / "Makefile").read_text()
    for target in set(re.findall(r"\bmake ([a-z-]+)", TEXT)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_running_needs_no_development_tools():
    """`make demo` sets up the smaller environment, `make test` the larger one on top of it."""
    makefile = (ROOT / "Makefile").read_text()
    assert "\ndemo: $(RUN)\n" in makefile and "\ntest: $(DEV)\n" in makefile and "\nlint: $(DEV)\n" in makefile
    assert "$(DEV): $(RUN)" in makefile
    for part in ("network", "growth"):
        assert f"-m iga_nn.compile_kernels {part}\n" in makefile  # the first run does not wait for it


def test_hooks_are_the_linters_of_make():
    hooks = re.findall(r"entry: (\.venv/bin/[\w-]+)", (ROOT / ".pre-commit-config.yaml").read_text())
    commands = re.findall(
        r"^\t\$\(BIN\)/(\S+)", (ROOT / "Makefile").read_text().split("\nlint:")[1].split("\n\n")[0], re.M
    )
    assert hooks == [f".venv/bin/{name}" for name in commands]


def test_contributing_is_short():
    """Modules' docstrings say what they decide: an index of them here would be read by nobody, and grow old."""
    assert len(TEXT.split()) <= MOST_WORDS
