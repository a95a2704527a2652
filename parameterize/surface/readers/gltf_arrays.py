"""Arrays of glTF: elements of accessors, with their sparse entries in place, from buffers inside or beside the file.

(Khronos, "glTF 2.0 Specification", 2021, section 3.6.)
"""

import binascii
from base64 import b64decode
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import IntArray
from ..errors import MeshError
from .common import DAMAGED, Beside
from .gltf_extensions import compression_of

# By componentType; the last one by KHR_accessor_float64.
NUMBERS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4", 5130: "<f8"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass
class Arrays:
    """The accessors of a glTF.

    binary: the buffer that comes with a .glb, empty where there is none. beside: reads the files that a buffer names.
    """

    document: dict[str, Any]
    binary: bytes
    beside: Beside
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def count(self, number: Any) -> int:
        """Return how many elements an accessor has, at least one."""
        count = whole(self._accessor(number)["count"])
        if count < 1:
            raise MeshError(f"an array of the glTF has no elements; {DAMAGED}")
        return count

    def check_count(self, number: Any, expected: int, what: str) -> None:
        """Raise MeshError where an accessor has another number of elements than expected. what: its name."""
        if (count := self.count(number)) != expected:
            raise MeshError(f"{what} of the glTF has {count} elements, expected {expected}; {DAMAGED}")

    def is_stored(self, number: Any) -> bool:
        """Return whether the file has elements for an accessor; all elements of another one are zero."""
        return not {"bufferView", "sparse"}.isdisjoint(self._accessor(number))

    def rows(self, number: Any, kind: str, wanted: IntArray) -> NDArray[Any]:
        """Return the elements of an accessor that are `wanted`, (n,) ascending and below its count, as (n, width).

        kind: a name of `WIDTHS`. Normalized integers become float64 from -1 or 0 to 1, all others keep their type.
        Only these elements take memory. Raises MeshError for an array that the file does not have.
        """
        accessor = self._accessor(number)
        if accessor["type"] != kind:
            raise MeshError(f"an accessor of the glTF holds {accessor['type']!r:.20}, expected {kind}; {DAMAGED}")
        dtype, width, count = _dtype(accessor["componentType"]), WIDTHS[kind], self.count(number)
        found = np.zeros((len(wanted), width), dtype)
        if "bufferView" in accessor:
            found = self._stored(accessor, dtype, count, width)[wanted]
        if "sparse" in accessor:
            self._replace(found, accessor["sparse"], wanted, count)
        if accessor.get("normalized") and dtype.kind in "iu":
            return np.maximum(found / float(np.iinfo(dtype).max), -1.0)
        return found

    def numbers(self, number: Any, kind: str, wanted: IntArray) -> IntArray:
        """Return elements as `rows` does. Raises MeshError where they are no unsigned whole numbers."""
        found = self.rows(number, kind, wanted)
        if found.dtype.kind != "u":
            raise MeshError(f"numbers of vertices or joints of the glTF are no unsigned whole numbers; {DAMAGED}")
        return found.astype(np.int64)

    def _accessor(self, number: Any) -> dict[str, Any]:
        return item(self.document.get("accessors", []), number, "accessor")

    def _replace(self, found: NDArray[Any], sparse: dict[str, Any], wanted: IntArray, count: int) -> None:
        """Put the sparse entries of an accessor of `count` elements into those that were `found`, (n, width)."""
        entries, (n, width) = whole(sparse["count"]), found.shape
        if not 1 <= entries <= count:
            raise MeshError(f"{entries} sparse entries of a glTF accessor of {count} elements; {DAMAGED}")
        dtype = _dtype(sparse["indices"]["componentType"])
        if dtype.kind != "u":
            raise MeshError(f"the indices of a sparse glTF accessor are no whole numbers; {DAMAGED}")
        places = self._stored(sparse["indices"], dtype, entries, 1).ravel().astype(np.int64)
        if (np.diff(places) <= 0).any() or places[-1] >= count:
            raise MeshError(f"the indices of a sparse glTF accessor must increase and stay below {count}; {DAMAGED}")
        values = self._stored(sparse["values"], found.dtype, entries, width)
        row = np.searchsorted(wanted, places)
        taken = row < n
        taken[taken] = wanted[row[taken]] == places[taken]
        found[row[taken]] = values[taken]

    def _stored(self, source: dict[str, Any], dtype: np.dtype[Any], count: int, width: int) -> NDArray[Any]:
        """Return a view (count, width) of the buffer view that a source names."""
        view = item(self.document.get("bufferViews", []), source["bufferView"], "buffer view")
        data = self._buffer(view)
        size = dtype.itemsize * width
        step = whole(view.get("byteStride", 0)) or size
        start = whole(view.get("byteOffset", 0)) + whole(source.get("byteOffset", 0))
        if step < size or start + (count - 1) * step + size > len(data):
            raise MeshError(f"an array of the glTF reaches beyond its {len(data)} bytes; {DAMAGED}")
        return np.ndarray((count, width), dtype, data, start, (step, dtype.itemsize))

    def _buffer(self, view: dict[str, Any]) -> bytes:
        """Return the buffer of a view. Only the first may come with a .glb; others without a name have no bytes."""
        number = whole(view["buffer"])
        if number not in self._buffers:
            uri = item(self.document.get("buffers", []), number, "buffer").get("uri")
            if uri is not None:
                self._buffers[number] = _embedded(uri) if uri.startswith("data:") else self.beside(uri)
            elif number == 0 and self.binary:
                self._buffers[number] = self.binary
            elif packed := compression_of(view):
                raise MeshError(f"compressed by {packed}, which is not read: save it without compression")
            else:
                raise MeshError(f"buffer {number} of the glTF has no bytes; {DAMAGED}")
        return self._buffers[number]


def whole(value: Any) -> int:
    """Return a whole number that is not negative; a list would count a negative one from its end."""
    if not isinstance(value, int) or value < 0:
        raise MeshError(f"a number of the glTF must be whole and not negative, got {value!r:.40}; {DAMAGED}")
    return value


def item(rows: list[Any], number: Any, what: str) -> dict[str, Any]:
    """Return the object of a list by its number. what: its name for the MeshError where there is none."""
    if whole(number) >= len(rows):
        raise MeshError(f"the glTF names {what} {number}, it has {len(rows)} (counted from 0); {DAMAGED}")
    return rows[number]


def _dtype(component: Any) -> np.dtype[Any]:
    if component not in NUMBERS:
        raise MeshError(f"an array of the glTF has the unknown componentType {component!r:.20}; {DAMAGED}")
    return np.dtype(NUMBERS[component])


def _embedded(uri: str) -> bytes:
    """Return the bytes of a data URI."""
    try:
        return b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error as error:
        raise MeshError(f"an array of the glTF is no base64 ({error}); {DAMAGED}") from None
