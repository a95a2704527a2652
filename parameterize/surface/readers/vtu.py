"""A limit on what the compressed arrays of a .vtu unpack to: meshio takes whatever is in them.

A few kilobytes can hold gigabytes of zeros; what a block really unpacks to is known only while it is unpacked.
"""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

from ..errors import MeshError


@contextmanager
def unpacking_at_most(limit: int) -> Iterator[None]:
    """Within the block, meshio's reader raises MeshError where a .vtu unpacks to more than `limit` bytes in all."""
    from meshio.vtu import _vtu

    left = limit

    def capped(unpacker: Callable[[], Any]) -> SimpleNamespace:
        def decompress(packed: bytes) -> bytes:
            nonlocal left
            stream = unpacker()
            data: bytes = stream.decompress(packed, max_length=left + 1)
            left -= len(data)
            if left < 0:
                raise MeshError(f"unpacks to more than {limit} bytes")
            if not stream.eof:
                raise MeshError("an array of it ends too early")
            return data

        return SimpleNamespace(decompress=decompress)

    before = _vtu.zlib, _vtu.lzma
    _vtu.zlib, _vtu.lzma = capped(zlib.decompressobj), capped(lzma.LZMADecompressor)
    try:
        yield
    finally:
        _vtu.zlib, _vtu.lzma = before
