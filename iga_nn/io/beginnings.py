"""Tells volumes from surfaces, and volumes of other programs from each other, by the beginnings of their files."""

import re
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from parameterize.surface.readers.file import FORMATS as SURFACES

from .words import PACKED

HEAD = 4096  # bytes by which a kind is told
ALIKE = (".gltf", ".3mf")  # surfaces that begin as volumes do
GEOPDES = re.compile(r"^\s*#.*nurbs (?:mesh|geometry) v\.?(\d{1,3})\.", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Beginning:
    """Hold how the files of a format are recognized: a row of the table of volumes that are read.

    ending: of their names. begins: how their text begins. holds: what it also holds near its beginning.
    """

    ending: str
    begins: str
    holds: re.Pattern[str] = re.compile("")


KINDS = {
    "gismo": Beginning(".xml", "<", re.compile(r"<xml\b", re.ASCII)),
    "mfem": Beginning(".mesh", "MFEM NURBS"),
    "geopdes": Beginning(".txt", "#", GEOPDES),
    "json": Beginning(".json", "{"),
}


def is_volume(path: str | Path) -> bool:
    """Return whether a file is a volume (rather than a surface), by its ending .npz or by its beginning.

    Surfaces begin alike (glTF as JSON, 3MF as a ZIP archive), so the ending must be one that is read here, for a volume
    or for a surface that does not; a .zip is a volume where it holds arrays, of a .gz the ending before counts.
    """
    source = Path(path)
    suffix = (Path(source.stem) if source.suffix.lower() == ".gz" else source).suffix.lower()
    read = (kind.ending for kind in KINDS.values())
    endings = ("", ".zip", *read, *(ending for ending in SURFACES if ending not in ALIKE))
    if suffix == ".npz":
        return True
    if suffix not in endings or not source.is_file() or kind_of(source) is None:
        return False
    return suffix != ".zip" or _holds_arrays(source)


def _holds_arrays(path: Path) -> bool:
    """Return whether an archive is one of numpy's."""
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.endswith(".npy") for name in archive.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return False


def kind_of(path: Path) -> str | None:
    """Return the kind of a file by its beginning, also of a packed one: one of KINDS, "npz", or None.

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
    kinds = KINDS.items()
    return next((name for name, kind in kinds if text.startswith(kind.begins) and kind.holds.search(text)), None)


def _unpacked(packed: bytes) -> bytes:
    """Return the beginning of what is packed by gzip in the beginning of a file; b"" for what is damaged."""
    try:
        return zlib.decompressobj(wbits=zlib.MAX_WBITS | 16).decompress(packed, HEAD)
    except zlib.error:
        return b""
