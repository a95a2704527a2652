"""Numbers of a section one after another, from text or from bytes, read in the same way."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .common import DAMAGED, NUMBERS, WHOLE_NUMBERS, header_count

Columns = Sequence[tuple[str, int]]  # of a table: numpy's name of the type, and the number of such columns


class Text:
    """OffWords; `what` names their section in messages."""

    def __init__(self, content: bytes, what: str) -> None:
        self._words = content.decode("latin-1").split()
        self._at = 0
        self._what = what

    def count(self) -> int:
        """Return the number that a table begins with."""
        return header_count(self._next(1)[0])

    @property
    def left(self) -> int:
        """Return the number of words that are left."""
        return len(self._words) - self._at

    def whole(self, count: int) -> list[int]:
        """Return the next whole numbers."""
        words = self._next(count)
        if words and not WHOLE_NUMBERS.fullmatch(" ".join(words)):
            raise MeshError(f"{self._what} has {' '.join(words)[:40]!r} where whole numbers are expected; {DAMAGED}")
        return [int(word) for word in words]

    large = whole

    def table(self, rows: int, columns: Columns) -> list[NDArray[Any]]:
        """Return a table's parts (rows, number of columns), whole numbers as int64."""
        width = sum(number for _, number in columns)
        words = np.array(self._next(rows * width), dtype=np.str_).reshape(rows, width)
        parts, start = [], 0
        for kind, number in columns:
            part = words[:, start : start + number]
            pattern = NUMBERS if kind[0] == "f" else WHOLE_NUMBERS
            if part.size and not pattern.fullmatch(" ".join(part.ravel().tolist())):
                raise MeshError(f"{self._what} has a word that is no number; {DAMAGED}")
            parts.append(part.astype(np.float64 if kind[0] == "f" else np.int64))
            start += number
        return parts

    def _next(self, count: int) -> list[str]:
        if not 0 <= count <= self.left:
            raise _too_few(self._what, count, self.left, "numbers")
        self._at += count
        return self._words[self._at - count : self._at]


class Binary:
    """Bytes, the lowest of a number first where `order` is "<"; `what` names their section in messages."""

    def __init__(self, content: bytes, order: str, what: str) -> None:
        self._bytes, self._order, self._what = content, order, what
        self._at = 0

    def count(self) -> int:
        """Return the number that a table begins with, which is a line of text."""
        line, _, _ = self._bytes[:40].partition(b"\n")
        self._at = len(line) + 1
        return header_count(line.decode("latin-1").strip())

    def whole(self, count: int) -> list[int]:
        """Return the next whole numbers of 4 bytes."""
        return self.table(1, [("i4", count)])[0][0].tolist()

    def large(self, count: int) -> list[int]:
        """Return the next whole numbers of 8 bytes."""
        return self.table(1, [("i8", count)])[0][0].tolist()

    def table(self, rows: int, columns: Columns) -> list[NDArray[Any]]:
        """Return a table's parts (rows, number of columns), whole numbers as int64."""
        if any(number < 0 for _, number in columns):
            raise MeshError(f"{self._what} has a negative number of columns; {DAMAGED}")
        needed = rows * sum(np.dtype(kind).itemsize * number for kind, number in columns)
        left = len(self._bytes) - self._at
        if not 0 <= needed <= left:
            raise _too_few(self._what, needed, left, "bytes")
        if rows == 0:
            return [np.empty((0, number), np.float64 if kind[0] == "f" else np.int64) for kind, number in columns]
        row = np.dtype([(f"f{k}", self._order + kind, (number,)) for k, (kind, number) in enumerate(columns)])
        held = np.frombuffer(self._bytes, row, rows, self._at)
        self._at += rows * row.itemsize
        return [held[f"f{k}"].astype(np.float64 if kind[0] == "f" else np.int64) for k, (kind, _) in enumerate(columns)]


Source = Text | Binary


def _too_few(what: str, needed: int, left: int, unit: str) -> MeshError:
    return MeshError(f"{what} promises {needed} more {unit}, where {left} follow; {DAMAGED}")
