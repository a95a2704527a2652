"""ColorRange: which values the ends of a colour bar stand for, also of fields that are constant, zero or tiny."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.arrays import Array

DECADES = 1e-4  # of a logarithmic range: its lower end over the smallest of the meshes' largest values
SMALLEST = 1e-200  # values below which a colour bar has no ticks of its own
ROUNDING = 1e-14  # share of the values within which they count as one


@dataclass(frozen=True)
class ColorRange:
    """Limits of a colour scale.

    remark: what the colour bar says in place of ticks where the field has one value, such as "0 everywhere".
    """

    low: float
    high: float
    logarithmic: bool = False
    remark: str = ""

    def norm(self) -> Any:
        """The range as matplotlib takes it: values to 0..1; a new one each time, for colour bars change theirs."""
        from matplotlib.colors import LogNorm, Normalize

        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high, clip=True)

    def shares(self, values: Array) -> Array:
        """Where values lie in the range, 0..1; half-way where the field has one value."""
        if self.remark:
            return np.full(np.shape(values), 0.5)
        return np.asarray(self.norm()(np.ravel(values))).reshape(np.shape(values))

    @property
    def labels(self) -> tuple[str, str]:
        """What stands at the two ends of a legend."""
        form = "{:.1e}" if self.logarithmic else "{:.3g}"
        return (self.remark, "") if self.remark else (form.format(self.low), form.format(self.high))


def even_range(values: Sequence[Array]) -> ColorRange:
    """From the lowest to the highest of all values."""
    low, high = min(float(patch.min()) for patch in values), max(float(patch.max()) for patch in values)
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(size))
    if high - low <= ROUNDING * size:
        return ColorRange(0.0, 1.0, remark=f"{high:.4g} everywhere")
    return ColorRange(low, high)


def error_range(meshes: Sequence[Sequence[Array]]) -> ColorRange:
    """Logarithmic, from the largest error of all meshes to four decades below that of the best one that has any."""
    tops = [max(float(error.max()) for error in errors) for errors in meshes]
    if max(tops) < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(max(tops)))
    return ColorRange(DECADES * min(top for top in tops if top >= SMALLEST), max(tops), logarithmic=True)


def _smaller(size: float) -> str:
    return f"below {size:.0e} everywhere" if size > 0.0 else "0 everywhere"
