"""Every command and every Python block of README.md and of the documentation's pages is run, trainings shortened."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest
from documents import PAGES, README, ROOT, blocks, commands

from iga_nn.cli.commands import main

TRAINS = ("run", "parameterize")
SOLVES = ("run", "solve", "study", "modes")


def test_commands_run(in_folder, short_training):
    """Those of README.md first: the pages go on with its results. What stands in two places is run once."""
    assert len(commands(README)) >= 6
    known = {" ".join(words): words for page in PAGES for words in commands(page)}
    assert len(known) >= 20
    for program, *arguments in known.values():
        if program == "make":
            assert re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
            continue
        assert program == "iga-nn"
        if arguments[0] in SOLVES and "--help" not in arguments:  # so short a training gives no part
            arguments.append("--solve-anyway")
        if arguments[0] in TRAINS and "--help" not in arguments:  # so short, it may fold, or be no part: 3, 5
            assert main(arguments) in (0, 3, 5), arguments
        else:
            folded_is_fine = arguments[0] in ("solve", "study") or "volume.npz" in arguments[1]
            assert main(arguments) in ((0, 3, 5) if folded_is_fine else (0,)), arguments


def test_python_runs(in_folder, short_training, capsys):
    for block, says in zip(blocks(README, "python"), ("rate", "von Mises from"), strict=True):
        exec(compile(block, "README.md", "exec"), {})  # noqa: S102 our own text
        assert says in capsys.readouterr().out
    assert Path("volume.npz").exists() and Path("solution.vtu").exists()


@pytest.mark.parametrize("page", [page for page in PAGES[1:] if blocks(page, "python")], ids=lambda page: page.stem)
def test_what_a_page_shows_is_what_python_answers(page, in_folder, short_training):
    text = "\n".join(blocks(page, "python"))
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    runner.run(parser.get_doctest(text, {}, page.name, str(page), 0))
    assert runner.tries > 0 and runner.failures == 0


@pytest.mark.parametrize("code", ["0", "1", "2", "3", "4", "130"])
def test_exit_codes_are_explained(code):
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert re.search(rf"^\| {code} \| \w", text, flags=re.MULTILINE)


def test_links_and_pictures_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", README.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    picture = ROOT / "examples" / "pictures" / "seashell.png"
    assert picture.stat().st_size < 300_000


def test_readme_is_short():
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 130 and max(map(len, lines)) <= 420  # rows of tables are the longest
