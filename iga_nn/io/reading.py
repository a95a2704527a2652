"""Tells the kinds of volume files apart by their beginnings, and reads those of other programs."""

import re
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from parameterize.spline.body import Body
from parameterize.spline.interface import Face
from parameterize.spline.volume import BSplineVolume

from . import geopdes, gismo, mfem, splinepy
from .patches import body_of
from .words import PACKED, text_of

HEAD = 4096  # bytes by which a kind is told

Content = tuple[Sequence[BSplineVolume], Iterable[tuple[Face, Face]]]  # patches, and faces that are declared glued

READERS: dict[str, Callable[[str], Content]] = {
    "gismo": gismo.read_gismo,
    "mfem": mfem.read_mfem,
    "geopdes": geopdes.read_geopdes,
    "json": splinepy.read_json,
}
ENDINGS = {"gismo": ".xml", "mfem": ".mesh", "geopdes": ".txt", "json": ".json"}


def kind_of(path: Path) -> str | None:
    """Return the kind of a file by its beginning, also of a packed one: one of READERS, "npz", or None.

    Raises OSError.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    if head.startswith(PACKED):
        head = _unpacked(head)
    head = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"<") and re.search(rb"<xml\b", head):
        return "gismo"
    if head.startswith(b"#"):
        return "geopdes" if geopdes.HEADER.search(head.decode(errors="replace")) else None
    marks = {b"MFEM NURBS": "mfem", b"{": "json", b"PK": "npz"}
    return next((kind for mark, kind in marks.items() if head.startswith(mark)), None)


def _unpacked(packed: bytes) -> bytes:
    """Return the beginning of what is packed by gzip in the beginning of a file; b"" for what is damaged."""
    try:
        return zlib.decompressobj(wbits=zlib.MAX_WBITS | 16).decompress(packed, HEAD)
    except zlib.error:
        return b""


def read_body(path: Path, kind: str, tolerance: float) -> Body:
    """Return the body of a file, of several patches with their interfaces.

    kind: one of READERS. tolerance: as in `Body.from_patches`. Raises OSError, and ValueError where the file is
    damaged, or its patches do not fit together.
    """
    try:
        return body_of(*READERS[kind](text_of(path)), tolerance)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
