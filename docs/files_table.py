"""Writes the table of files in output.md from that of the program; `make docs` runs it."""

import re
from pathlib import Path

from iga_nn.report.artifacts import ARTIFACTS, Artifact

PAGE = Path(__file__).with_name("output.md")
HEAD = "| file | content |\n| --- | --- |\n"


def refreshed(text: str) -> str:
    """Return a page with its table of files written anew."""
    rows = "".join(map(_row, ARTIFACTS))
    return re.sub(rf"(?<={re.escape(HEAD)})(\|.*\n)*", lambda _: rows, text)


def _row(artifact: Artifact) -> str:
    arrays = ": " + ", ".join(f"`{name}`" for name in artifact.arrays) if artifact.arrays else ""
    return f"| `{artifact.file}` | {artifact.shows}{arrays} |\n"


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
