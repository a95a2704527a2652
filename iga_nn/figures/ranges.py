"""The range of a field's colours, and the words at its colour bar, for figures and the interactive view alike.

Nothing here loads the figures of matplotlib, which take longer than a view is made in.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LogNorm, Normalize

from parameterize.arrays import Array

DECADES = 1e-4  # lower end of a logarithmic range over the largest error of the best mesh
SMALLEST = 1e-200  # smaller fields have no ticks on their colour bar
ROUNDING = 1e-14  # values whose relative difference is smaller count as one


@dataclass(frozen=True)
class ColorRange:
    """Hold the limits of a colour scale.

    remark: stands in place of ticks where the field has one value, such as "0 everywhere".
    """

    low: float
    high: float
    logarithmic: bool = False
    remark: str = ""

    def norm(self) -> Normalize:
        """Return the range as a new object of matplotlib, which maps values to 0..1; colour bars change theirs."""
        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high, clip=True)

    def shares(self, values: Array) -> Array:
        """Return the places of values in the range, 0..1; 0.5 where the field has one value."""
        if self.remark:
            return np.full(np.shape(values), 0.5)
        return np.asarray(self.norm()(np.ravel(values))).reshape(np.shape(values))

    @property
    def labels(self) -> tuple[str, str]:
        """Return the texts at the two ends of a legend; a logarithmic one has all smaller values at its lower end."""
        if self.remark:
            return self.remark, ""
        if self.logarithmic:
            return f"≤ {self.low:.1e}", f"{self.high:.1e}"
        return f"{self.low:.3g}", f"{self.high:.3g}"


def even_range(values: Sequence[Array]) -> ColorRange:
    """Return the range from the lowest to the highest of all values."""
    low, high = min(float(patch.min()) for patch in values), max(float(patch.max()) for patch in values)
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(size))
    if high - low <= ROUNDING * size:
        return ColorRange(0.0, 1.0, remark=f"{high:.4g} everywhere")
    return ColorRange(low, high)


def error_range(meshes: Sequence[Sequence[Array]]) -> ColorRange:
    """Return a logarithmic range: from four decades below the largest error of the best mesh to that of the worst."""
    tops = [max(float(error.max()) for error in errors) for errors in meshes]
    if max(tops) < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(max(tops)))
    return ColorRange(DECADES * min(top for top in tops if top >= SMALLEST), max(tops), logarithmic=True)


def _smaller(size: float) -> str:
    return f"below {size:.0e} everywhere" if size > 0.0 else "0 everywhere"


def with_unit(title: str, unit: str | None) -> str:
    """Return the title of a colour bar with its unit; a dollar in it begins no formula of matplotlib."""
    return title if unit is None else title + " [" + unit.replace("$", r"\$") + "]"
