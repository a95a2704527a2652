"""The table of volume files of other programs: tells them apart by their beginnings, and reads them."""

import re
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parameterize.spline.body import Body
from parameterize.spline.interface import Face
from parameterize.spline.volume import BSplineVolume

from . import geopdes, gismo, mfem, mfem_writer, splinepy, view, vtk
from .patches_of_files import body_of
from .words import PACKED, faults_of, text_of

HEAD = 4096  # bytes by which a kind is told

Content = tuple[Sequence[BSplineVolume], Iterable[tuple[Face, Face]]]  # patches, and faces that are declared glued


@dataclass(frozen=True)
class Format:
    """Hold a format of another program: a row of the table of volumes.

    ending: of its files, after the volume's stem where they are written. write: puts the volume into a file; it is also
    given the solution and its problem, None where there are none, and the samples and quantities of a view. beside:
    ending and writer of a second file, where the solution needs one; it is given the volume, too. read: makes patches
    of a text. begins: how the text of a file begins that is read. holds: what it also holds near its beginning.
    """

    ending: str
    write: Callable[..., None] | None = None
    beside: tuple[str, Callable[[Path, Any, Any], None]] | None = None
    read: Callable[[str], Content] | None = None
    begins: str = ""
    holds: re.Pattern[str] = re.compile("")


FORMATS = {
    "gismo": Format(
        ".xml",
        gismo.write_gismo,
        ("_u.xml", gismo.write_gismo_field),
        gismo.read_gismo,
        "<",
        re.compile(r"<xml\b", re.ASCII),
    ),
    "mfem": Format(
        ".mesh", mfem_writer.write_mfem, (".gf", mfem_writer.write_mfem_field), mfem.read_mfem, "MFEM NURBS"
    ),
    "geopdes": Format(".txt", read=geopdes.read_geopdes, begins="#", holds=geopdes.HEADER),
    "vtk": Format("_bezier.vtu", vtk.write_bezier),
    "view": Format("_view.vtu", view.write_view),
    "json": Format(".json", splinepy.write_json, ("_u.json", splinepy.write_json), splinepy.read_json, "{"),
}


def kind_of(path: Path) -> str | None:
    """Return the kind of a file by its beginning, also of a packed one: one of FORMATS, "npz", or None.

    Raises OSError.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    if head.startswith(PACKED):
        head = _unpacked(head)
    head = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"PK"):
        return "npz"
    text = head.decode(errors="replace")
    kinds = ((name, kind) for name, kind in FORMATS.items() if kind.read is not None)
    return next((name for name, kind in kinds if text.startswith(kind.begins) and kind.holds.search(text)), None)


def _unpacked(packed: bytes) -> bytes:
    """Return the beginning of what is packed by gzip in the beginning of a file; b"" for what is damaged."""
    try:
        return zlib.decompressobj(wbits=zlib.MAX_WBITS | 16).decompress(packed, HEAD)
    except zlib.error:
        return b""


def read_body(path: Path, kind: str, tolerance: float) -> Body:
    """Return the body of a file, of several patches with their interfaces.

    kind: one of FORMATS that is read. tolerance: as in `Body.from_patches`. Raises OSError, and ValueError where the
    file is damaged, or its patches do not fit together.
    """
    read = FORMATS[kind].read
    assert read is not None  # as `kind_of` finds it
    with faults_of(path):
        return body_of(*read(text_of(path)), tolerance)
