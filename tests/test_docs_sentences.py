"""Pages have sentences that a reader can hold: code, tables and displayed formulas are not counted."""

from __future__ import annotations

import re

import pytest
from documents import ROOT

MOST_WORDS = 30
PAGES = (
    "docs/method.md",
    "docs/solver.md",
    "docs/intervals.md",
    "docs/ways.md",
    "docs/blocks.md",
    "docs/sharp_edges.md",
    "docs/stages.md",
    "docs/limits.md",
    "docs/patches.md",
    "CONTRIBUTING.md",
)
DISPLAYED = re.compile(r"^\$\$\n(.*?)(\.?)\n\$\$$", flags=re.DOTALL | re.MULTILINE)
LEFT_OUT = re.compile(
    r"^```.*?^```$|^\s*\|.*?$|^#.*?$|^<!--.*?-->$|\((?:https?:|[\w./]+\.md)[^()]*\)", flags=re.DOTALL | re.MULTILINE
)
FORMULA = re.compile(r"\$[^$]+\$|`[^`]+`")  # within a line: read as one word
NO_END = re.compile(r"\b([A-Z]|al|Appl|Comput|Math|Numer|Phys|Sci)\.(?= )")  # initials and names of journals
ITEM = re.compile(r"\n(?=\s*(?:[-*]|\d+\.) )|\n{2,}(?=\s*(?:[-*]|\d+\.) )")


def sentences(text: str) -> list[str]:
    """Return the sentences of a page; one that goes on behind a displayed formula or a table is one sentence."""
    text = NO_END.sub(r"\1", FORMULA.sub("formula", LEFT_OUT.sub("", DISPLAYED.sub(r"\2", text))))
    parts = (part for item in ITEM.split(text) for part in re.split(r"(?<=[.:!?])\s*\n{2,}", item))
    plain = (" ".join(part.replace("*", " ").split()).removeprefix("- ").replace(" .", ".") for part in parts)
    return [one for part in plain for one in re.split(r"(?<=[.!?])[\")]* (?=[A-Zf(\[])", part) if one]


@pytest.mark.parametrize("page", PAGES)
def test_no_sentence_is_long(page):
    found = sentences((ROOT / page).read_text(encoding="utf-8"))
    assert len(found) > 10
    assert [one for one in found if len(one.split()) > MOST_WORDS] == []


def test_what_a_sentence_is():
    text = "# Head\n\nOne is $a + b$, by\n\n$$\nc d\n$$\n\nand ends `x y`. $F$ is (Lee et al. 1994)\n\n$$\nc d.\n$$\n\n"
    text += "Two:\n\n- three\n- [four](a.md#b)\n"
    assert [len(one.split()) for one in sentences(text)] == [7, 6, 1, 1, 1]
