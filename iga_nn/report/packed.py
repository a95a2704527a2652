"""Packs samples for the page: numbers between 0 and 1 as whole numbers in Base64."""

import base64
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array, IntArray

from ..figures.fields import Samples


@dataclass(frozen=True, eq=False)
class Drawn:
    """Say which samples of a body the page has: those on some faces, and in the lattices, every second for `coarser` 2.

    faces: the places of the outer faces among the nine faces and sections of each patch.
    """

    faces: IntArray
    coarser: int

    def thinned(self, samples: Samples) -> tuple[Array, Array]:
        """Return every second point on the faces (f, m, m, ...) and all points in the lattices (patches, n, n, n, ...).

        With `coarser` 2 both have half as many points a direction.
        """
        step, twice = slice(None, None, self.coarser), slice(None, None, 2 * self.coarser)
        return samples.on(self.faces)[:, twice, twice], samples.lattices[:, step, step, step]

    def packed(self, samples: Samples, shares: Callable[[Array], Array]) -> dict[str, str]:
        """Return the packed shares of samples, on the faces and in the lattices."""
        faces, lattices = self.thinned(samples)
        return {"faces": packed(shares(faces)), "lattice": packed(shares(lattices))}


def packed(shares: NDArray[Any], kind: type[np.unsignedinteger[Any]] = np.uint16) -> str:
    """Return numbers 0..1 as whole numbers over the range of `kind`, little-endian, in Base64."""
    numbers = np.rint(np.clip(shares, 0.0, 1.0) * np.iinfo(kind).max).astype(np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(numbers.tobytes()).decode("ascii")


def numbered(numbers: NDArray[Any], kind: type[np.unsignedinteger[Any]] = np.uint32) -> str:
    """Return whole numbers, little-endian, in Base64."""
    return base64.b64encode(numbers.astype(np.dtype(kind).newbyteorder("<")).tobytes()).decode("ascii")
