"""VTK's .vtu, read by meshio once what it declares, and what its compressed arrays unpack to, is within the limits.

A few kilobytes can hold gigabytes of zeros; what a block really unpacks to is known only while it is unpacked.
"""

import lzma
import re
import zlib
from base64 import b64decode
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import MeshError
from .cells import read_by_meshio
from .common import DAMAGED, Content, library, most_bytes

UNPACKERS: dict[str, Callable[[], Any]] = {
    "vtkZLibDataCompressor": zlib.decompressobj,
    "vtkLZMADataCompressor": lzma.LZMADecompressor,
}


def read_vtu(data: bytes, max_faces: int) -> Content:
    """Read a .vtu of one piece."""
    import meshio.vtu

    if b"<VTKFile" not in data[:4096] or b"</VTKFile>" not in data[-256:]:
        raise MeshError(f"not a whole .vtu: no <VTKFile> ... </VTKFile>; {DAMAGED}")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise MeshError("the .vtu declares a document type, whose entities are not expanded: remove the declaration")
    pieces = len(re.findall(rb"<Piece\b", data))
    if pieces > 1:
        raise MeshError(
            f"the .vtu holds {pieces} pieces: merge them into one, in ParaView with Merge Blocks, and save it"
        )
    _check_unpacked(data, most_bytes(max_faces))
    return read_by_meshio(data, ".vtu", meshio.vtu.read)


def _check_unpacked(data: bytes, limit: int) -> None:
    """Raise MeshError where the compressed arrays unpack to more than `limit` bytes in all."""
    left = limit
    with library(".vtu"):
        head, _, rest = data.partition(b"<AppendedData")
        root = ElementTree.fromstring(head + b"</VTKFile>" if rest else data)  # noqa: S314 - it has no entities
        if "compressor" not in root.attrib:
            return
        tag, _, appended = rest.rpartition(b"</AppendedData")[0].partition(b"_")
        order = ">" if root.get("byte_order") == "BigEndian" else "<"
        word = np.dtype(order + ("u8" if root.get("header_type") == "UInt64" else "u4"))
        for array in root.iter("DataArray"):
            if array.get("format") == "appended":
                packed, is_raw = appended[int(array.attrib["offset"]) :], b"raw" in tag
            elif array.get("format") == "binary":
                packed, is_raw = (array.text or "").strip().encode(), False
            else:
                continue
            for block in _blocks(packed, word, is_raw=is_raw):
                unpacker = UNPACKERS[root.attrib["compressor"]]()
                left -= len(unpacker.decompress(block, max_length=left + 1))
                if left < 0:
                    raise ValueError(f"unpacks to more than {limit} bytes")
                if unpacker.unused_data:
                    raise ValueError("an array holds more than its blocks")


def _blocks(packed: bytes, word: np.dtype[Any], *, is_raw: bool) -> Iterator[bytes]:
    """Yield the compressed blocks of an array, raw or base64; before them stand their number and their sizes."""

    def place(size: int) -> int:
        return size if is_raw else -(-size // 3) * 4

    decode = bytes if is_raw else b64decode
    count = int(np.frombuffer(decode(packed[: place(word.itemsize)])[: word.itemsize], word)[0])
    table = (3 + count) * word.itemsize
    sizes = np.frombuffer(decode(packed[: place(table)])[:table], word)[3:]
    body = decode(packed[place(table) :])
    ends = np.cumsum(sizes, dtype=word)
    for start, end in zip([0, *ends], ends, strict=False):
        yield body[start:end]
