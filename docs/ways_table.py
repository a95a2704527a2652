"""Writes the table of ways in ways.md from that of the strategy; `make docs` runs it."""

import re
from pathlib import Path

from parameterize.ways import strategy

PAGE = Path(__file__).with_name("ways.md")
BEGIN, END = "<!-- ways: made from parameterize/ways/strategy.py -->\n\n", "\n<!-- end of ways -->"
PLACES = {  # of the maps of the table: where pages explain them
    "exact blocks": "sharp_edges.md",
    "blocks over their profiles": "sharp_edges.md#stacks-of-extrusions-with-curved-outlines",
    "one cube, cut into blocks, and rods on its faces": "blocks.md#how-they-are-made",
    "rods and junctions": "blocks.md",
    "one cube, laid along them": "sharp_edges.md#other-parts-with-curved-faces",
    "one cube, trained, fitted and optimised": "method.md#1-train",
    "one cube that grows into the solid": "method.md#4-grow-if-the-network-does-not-suit",
}


def refreshed(text: str) -> str:
    """Return a page with its table of ways written anew."""
    table = "".join(f"{row}\n" for row in (strategy.__doc__ or "").splitlines() if row.startswith("|"))
    for words, place in PLACES.items():
        table = table.replace(f"| {words}", f"| [{words}]({place})")
    return re.sub(f"(?<={re.escape(BEGIN)}).*?(?={re.escape(END)})", lambda _: table, text, flags=re.DOTALL)


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
