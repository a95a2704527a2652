"""Reads a text file of numbers word by word, and says at which line something is wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from parameterize.arrays import Array
from parameterize.files import gunzip

MAX_BYTES = 128 << 20
PACKED = b"\x1f\x8b"  # the first bytes of gzip


def text_of(path: Path) -> str:
    """Return the text of a file, which may be packed by gzip; a text that is not in UTF-8 is taken as Latin-1.

    Numbers and names of formats are the same in both, so that only comments depend on it. Raises OSError, and
    ValueError where the file is too large, or not whole.
    """
    if (size := path.stat().st_size) > MAX_BYTES:
        raise ValueError(f"has {size} bytes, more than {MAX_BYTES}")
    content = path.read_bytes()
    if content.startswith(PACKED):
        try:
            content = gunzip(content, MAX_BYTES)
        except ValueError as error:
            raise ValueError(f"is {error}: save it again") from None
    if len(content) > MAX_BYTES:
        raise ValueError(f"has more than {MAX_BYTES} bytes once it is unpacked")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


@contextmanager
def faults_of(what: object) -> Iterator[None]:
    """Put the name of what is read before the message of a ValueError of the block."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


class Words:
    """The words of a text in turn; rows that begin with # are comments. All functions raise ValueError with the line.

    what: in the functions below, the name of what is read, for the error.
    """

    def __init__(self, text: str) -> None:
        self._rows: Iterator[tuple[int, str]] = iter(enumerate(text.splitlines(), 1))
        self._line = 0
        self._words: list[str] = []
        self._at = 0

    def fault(self, reason: str) -> ValueError:
        """Return the error for a reason at the present line."""
        return ValueError(f"line {self._line}: {reason}")

    def peek(self) -> str | None:
        """Return the next word without taking it, None at the end."""
        while self._at == len(self._words):
            number, row = next(self._rows, (0, ""))
            if not number:
                return None
            self._line, self._at = number, 0
            self._words = [] if row.lstrip().startswith("#") else row.split()
        return self._words[self._at]

    def row(self, what: str) -> list[str]:
        """Return the words left in the present row, of the next row where there are none."""
        return self._part(None, what)

    def take(self, count: int, what: str) -> list[str]:
        """Return the next words, over as many rows as they take."""
        found: list[str] = []
        while len(found) < count:
            found += self._part(count - len(found), what)
        return found

    def _part(self, most: int | None, what: str) -> list[str]:
        """Return the next words of one row, all that are left of it or at most so many."""
        if self.peek() is None:
            raise ValueError(f"ends before {what}: the file is cut off, or a count in it is too large")
        found = self._words[self._at : None if most is None else self._at + most]
        self._at += len(found)
        return found

    def word(self, what: str) -> str:
        """Return the next word."""
        return self.take(1, what)[0]

    def whole(self, what: str) -> int:
        """Return the next word as a whole number that is not negative: a count, or a number of something."""
        return self.wholes(1, what)[0]

    def wholes(self, count: int, what: str) -> list[int]:
        """Return the next words as whole numbers that are not negative."""
        return self.as_wholes(self.take(count, what), what)

    def as_wholes(self, words: list[str], what: str) -> list[int]:
        """Return words as whole numbers that are not negative."""
        for word in words:
            if not (word.isascii() and word.isdigit() and len(word) < 19):  # a number of 64 bits
                raise self.fault(f"{what} must be a whole number, got {word[:40]!r}")
        return [int(word) for word in words]

    def reals(self, count: int, what: str) -> Array:
        """Return the next words as finite numbers (count,)."""
        return self.as_reals(self.take(count, what), what)

    def as_reals(self, words: list[str], what: str) -> Array:
        """Return words as finite numbers (n,)."""
        try:
            return finite_numbers(words, what)
        except ValueError as error:
            raise self.fault(str(error)) from None


def finite_numbers(words: list[str], what: str) -> Array:
    """Return words as finite numbers (n,). Raises ValueError with the word that is none.

    Words may be fractions such as 1/3, and have exponents as Fortran and MATLAB write them, 1D+0.
    """
    values = np.array([_number(word, what) for word in words], dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{what} must be finite, got {words[int(np.argmin(np.isfinite(values)))][:40]!r}")
    return values


def _number(word: str, what: str) -> float:
    if is_number(word):
        return float(word)
    above, slash, below = word.upper().replace("D", "E").partition("/")
    if not (is_number(above) and is_number(below or "1") and bool(slash) == bool(below)):
        raise ValueError(f"{what} must be numbers, got {word[:40]!r}")
    divisor = float(below or "1")
    return float(above) / divisor if divisor else float("inf")


def is_number(word: str) -> bool:
    """Return whether a word is a number with an exponent by E or none; digits are not grouped."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word
