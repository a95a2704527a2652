"""Makes batch.html: a row a surface with its picture, figures that sort and a link to its report; fetches nothing."""

import base64
import functools
import io
import logging
from pathlib import Path
from typing import Any
from urllib.parse import quote

from PIL import Image

from ..errors import one_line
from ..report.artifacts import PAGE
from ..report.html import filled
from ..version import __version__
from .table import FIGURES, Batch, Row

log = logging.getLogger(__name__)

PICTURE = "faces.png"  # of an output folder
THUMBNAIL = (120, 90)  # pixels, at most
COLORS = 64
KINDS = {"certified": "good", "not certified": "bad", "not solved": "unsure", "refused": "bad", "failed": "bad"}
WHOLE = ("seconds", "dofs", "iterations")


def page(batch: Batch) -> str:
    """Return the page as text."""
    return filled(
        "batch/batch.html",
        title=batch.folder.name,
        version=__version__,
        summary=batch.summary,
        titles=list(FIGURES.values()),
        rows=[_row(row) for row in batch.rows],
    )


def _row(row: Row) -> dict[str, Any]:
    """Return what the template shows of a row; each figure as its text and the value it is sorted by."""
    report = row.entry.folder / PAGE
    return {
        "name": row.entry.name,
        "state": row.state,
        "kind": KINDS.get(row.state, ""),
        "line": row.line,
        "link": quote(f"{row.entry.folder.name}/{PAGE}", errors="surrogateescape") if report.is_file() else "",
        "picture": _picture(row.entry.folder / PICTURE) if row.report is not None else "",
        "figures": [(_text(name, value), "" if value is None else value) for name, value in row.figures().items()],
    }


def _text(name: str, value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    return f"{value:,.0f}" if name in WHOLE else f"{value:.3g}"


def _picture(path: Path) -> str:
    """Return a small picture in Base64, empty where there is none."""
    try:
        return _thumbnail(path, path.stat().st_mtime_ns)
    except FileNotFoundError:
        return ""  # nothing can be drawn on this machine
    except Exception as error:  # no picture ends a batch
        log.warning("%s: no thumbnail: %s", path, one_line(error))
        return ""


@functools.lru_cache(maxsize=4096)
def _thumbnail(path: Path, _written: int) -> str:
    """Return the thumbnail of a picture; the page is written many times, and each picture is read once."""
    stream = io.BytesIO()
    with Image.open(path) as image:
        small = image.convert("RGB")
        small.thumbnail(THUMBNAIL)
        small.quantize(COLORS).save(stream, "png", optimize=True)
    return base64.b64encode(stream.getvalue()).decode("ascii")
