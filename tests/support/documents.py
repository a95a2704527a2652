"""README.md and the pages of docs: their blocks of code, and what is said to be run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import iga_nn

ROOT = Path(iga_nn.__file__).resolve().parents[1]
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md")), ROOT / "docs" / "api" / "index.md"]


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language, in the page's order."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return ["\n".join(line.removeprefix(indent) for line in text.splitlines()) + "\n" for indent, text in found]


def commands(page: Path) -> list[list[str]]:
    """The words of each command of a page."""
    return [shlex.split(line) for block in blocks(page, "sh") for line in block.splitlines()]


def documented_names() -> dict[str, Path]:
    """What the pages of the API document: the name as imported, and its page."""
    pages = (ROOT / "docs" / "api").glob("*.md")
    directive = re.compile(r"^\.\. auto(?:class|function|exception):: (\S+)$", re.MULTILINE)
    return {name: page for page in pages for name in directive.findall(page.read_text(encoding="utf-8"))}
