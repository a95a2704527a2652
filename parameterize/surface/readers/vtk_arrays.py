"""Arrays of a VTK XML file: text, base64 or raw, within the file or appended, compressed or not.

Written from vtkXMLWriter and vtkXMLDataParser. A few kilobytes can hold gigabytes of zeros: the unpacked bytes are
counted block by block, against a limit for the whole file.
"""

import lzma
import zlib
from base64 import b64decode
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .common import DAMAGED, header_count, number_array

TYPES = {f"{name}{8 * size}": f"{name[0].lower()}{size}" for name in ("Int", "UInt") for size in (1, 2, 4, 8)}
TYPES |= {"Float32": "f4", "Float64": "f8"}
WORDS = {"UInt32": "u4", "UInt64": "u8"}
LZMA_MEMORY = 1 << 28  # bytes of its dictionary
PACKED: dict[str, Callable[[], Any]] = {
    "vtkZLibDataCompressor": zlib.decompressobj,
    "vtkLZMADataCompressor": lambda: lzma.LZMADecompressor(memlimit=LZMA_MEMORY),
}
LZ4 = "vtkLZ4DataCompressor"


@dataclass
class Decoder:
    """Reads the arrays of a file as they are stored.

    order: "<" or ">". word: type of the sizes before the data. compressor: VTK's name, "" for none. appended: the bytes
    after the underscore of the section AppendedData. raw: these are no base64. left: bytes that arrays may unpack to.
    """

    order: str
    word: np.dtype[Any]
    compressor: str
    appended: bytes
    raw: bool
    left: int

    def numbers(self, array: Element, count: int) -> NDArray[Any]:
        """Return the `count` numbers of a DataArray, (count,)."""
        name = array.get("Name", "Points")
        kind = TYPES.get(array.get("type", ""))
        if kind is None:
            raise MeshError(f"the array {name!r:.40} has the type {array.get('type')!r:.40}: save it as numbers")
        if array.get("format", "ascii") == "ascii":
            found = number_array(_text(array).split(), f"the array {name!r:.40}", whole=kind[0] != "f")
        else:
            data = self._bytes(array, count * np.dtype(kind).itemsize)
            found = np.frombuffer(data, self.order + kind, len(data) // np.dtype(kind).itemsize)
        if len(found) < count:
            raise MeshError(f"the array {name!r:.40} holds {len(found)} numbers where {count} are promised; {DAMAGED}")
        return found[:count]

    def _bytes(self, array: Element, needed: int) -> bytes:
        """Return the bytes of a binary or appended array, of which `needed` are wanted."""
        form = array.get("format", "")
        if form == "appended":
            stream = Stream(self.appended[header_count(array.get("offset", "")) :], is_raw=self.raw)
        elif form == "binary":
            stream = Stream("".join(_text(array).split()).encode(), is_raw=False)
        else:
            raise MeshError(f"an array has the format {form!r:.40}: save as ascii, binary or appended")
        return self._unpacked(stream) if self.compressor else self._plain(stream, needed)

    def _plain(self, stream: "Stream", needed: int) -> bytes:
        size = int(np.frombuffer(stream.first(self.word.itemsize), self.word)[0])
        if size < needed:
            raise MeshError(f"an array holds {size} bytes where {needed} are promised; {DAMAGED}")
        return stream.after(self.word.itemsize, needed)

    def _unpacked(self, stream: "Stream") -> bytes:
        """Return the data of compressed blocks, before which stand number, size, last size and packed sizes."""
        item = self.word.itemsize
        blocks, size, last = (int(n) for n in np.frombuffer(stream.first(3 * item), self.word))
        sizes = np.frombuffer(stream.first((3 + blocks) * item), self.word)[3:].tolist()
        packed = stream.after((3 + blocks) * item, sum(sizes))
        found, start = [], 0
        for number, length in enumerate(sizes):
            full = last if last and number == blocks - 1 else size
            if full > self.left:
                raise MeshError("an array unpacks to more than the limit: decimate the surface or raise --max-faces")
            block = self._unpack(packed[start : start + length], full)
            if len(block) != full:
                raise MeshError(f"a compressed block unpacks to {len(block)} bytes, not {full}; {DAMAGED}")
            self.left -= full
            start += length
            found.append(block)
        return b"".join(found)

    def _unpack(self, block: bytes, size: int) -> bytes:
        if self.compressor == LZ4:
            return _unpack_lz4(block, size)
        if self.compressor not in PACKED:
            raise MeshError(f"compressed by {self.compressor[:40]!r}, which is unknown: save with zlib")
        try:
            return bytes(PACKED[self.compressor]().decompress(block, max_length=size + 1))
        except (zlib.error, lzma.LZMAError, EOFError) as error:
            raise MeshError(f"a compressed block does not unpack ({error}); {DAMAGED}") from None


@dataclass(frozen=True)
class Stream:
    """Bytes from where an array begins, raw or base64.

    The sizes before the data are encoded with them, or by themselves and then padded by `=`.
    """

    source: bytes
    is_raw: bool

    def first(self, size: int) -> bytes:
        """Return the first bytes."""
        return self._decoded(0, size)

    def after(self, start: int, size: int) -> bytes:
        """Return `size` bytes after the first `start` ones."""
        if self.is_raw:
            return self._decoded(start, size)
        end = _encoded(start)
        if self.source[end - 1 : end] == b"=":
            return self._decoded(end, size)
        return self._decoded(0, start + size)[start:]

    def _decoded(self, place: int, size: int) -> bytes:
        try:
            stored = self.source[place : place + (size if self.is_raw else _encoded(size))]
            data = stored if self.is_raw else b64decode(stored, validate=True)
        except ValueError as error:
            raise MeshError(f"an array is no base64 ({error}); {DAMAGED}") from None
        if len(data) < size:
            raise MeshError(f"an array ends after {len(data)} of {size} bytes; {DAMAGED}")
        return data[:size]


def _encoded(size: int) -> int:
    """Return how many characters of base64 hold so many bytes."""
    return -(-size // 3) * 4


def _text(array: Element) -> str:
    """Return the text of an element without that of the elements in it."""
    return "".join([array.text or "", *(inner.tail or "" for inner in array)])


def _unpack_lz4(block: bytes, size: int) -> bytes:
    """Unpack by VTK, which has LZ4 within it and checks both lengths; the result is empty where it fails."""
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkIOCore import vtkLZ4DataCompressor

    compressor: Any = vtkLZ4DataCompressor()  # its stubs do not know that it takes bytes and arrays
    data = np.zeros(size, dtype=np.uint8)
    speaks = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        return data[: compressor.Uncompress(block, len(block), data, size)].tobytes()
    finally:
        vtkObject.SetGlobalWarningDisplay(speaks)
