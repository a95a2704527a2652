"""Chooses colours: of a volume's faces, of the patches of a body, and of a field's values, for figures and views alike.

Nothing here loads the figures of matplotlib, which take longer than a view is made in.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle, islice
from typing import TYPE_CHECKING

import numpy as np

from parameterize.arrays import Array, Mask
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

from .palette import TEN, TWENTY, rgb, shaded

if TYPE_CHECKING:
    from matplotlib.colors import Normalize

FACE_COLORS = ("#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee6677", "#aa3377")  # also distinct for the colour-blind
PATCH_COLORS = TWENTY
REST = "#d1d1d1"  # the grey of a surface outside of all regions
MOST_NAMED = 31  # patches: of more, too many have the same colour for a legend

DECADES = 1e-4  # lower end of a logarithmic range over the largest error of the best mesh
SMALLEST = 1e-200  # smaller fields have no ticks on their colour bar
SHOWN = 0.99  # of the volume whose values have colours of their own, where peaks would take the others' colours
OUTSIDE = 0.5 * (1.0 - SHOWN)
TINY = 1e-6  # of the largest coordinate of a place: smaller ones are written as 0
SOLVED = 1e-6  # relative differences that are smaller are the linear solver's
WORTH = 0.2  # of the whole range: less at an end is not cut off
ROUNDING = 1e-14  # values whose relative difference is smaller count as one


def face_labels() -> list[str]:
    """Return the legend of the six colours, such as "u0: u = 0"."""
    return [f"{name}: {name[0]} = {name[1]}" for name in FACE_NAMES]


def face_colors(body: BodyLike) -> list[str]:
    """Return the colours of six faces of each patch: of a volume one a face, otherwise one a patch, or one a solid."""
    glued = as_body(body)
    if glued.is_single:
        return list(FACE_COLORS)
    owners = glued.solids.numbers.tolist() if glued.solids.are_several else range(len(glued))
    return [PATCH_COLORS[i % len(PATCH_COLORS)] for i in owners for _ in FACE_NAMES]


def color_labels(body: BodyLike) -> list[tuple[str, str]]:
    """Return the legend of the colours: each with a label such as "u0: u = 0", of several patches such as "p3, p23".

    Of several solids the labels are their names. Very many patches or solids have no legend.
    """
    glued = as_body(body)
    if glued.is_single:
        return list(zip(FACE_COLORS, face_labels(), strict=True))
    names = list(glued.solids.labels) if glued.solids.are_several else [f"p{i}" for i in range(len(glued))]
    if len(names) > MOST_NAMED:
        return []
    alike = [names[i :: len(PATCH_COLORS)] for i in range(min(len(names), len(PATCH_COLORS)))]
    return [(color, ", ".join(each)) for color, each in zip(PATCH_COLORS, alike, strict=False)]


def region_colors(count: int) -> Array:
    """Return `count` colours, and last the colour of the rest, (count + 1, 3)."""
    return np.array([*map(rgb, islice(cycle(TEN), count)), rgb(REST)])


@dataclass(frozen=True)
class ColorRange:
    """Hold the limits of a colour scale.

    remark: stands in place of ticks where the field has one value, such as "0 everywhere". beyond, below: the largest
    and the least value of the field where they lie outside of the range; they have the colours of its ends. places:
    those of these two values, where they are known. without: whether singular places do not count.
    """

    low: float
    high: float
    logarithmic: bool = False
    remark: str = ""
    beyond: float | None = None
    below: float | None = None
    places: tuple[Sequence[float] | None, Sequence[float] | None] = (None, None)
    without: bool = False

    @property
    def whole(self) -> "ColorRange":
        """Return the range from the least to the largest value of the field."""
        low = self.low if self.below is None else self.below
        high = self.high if self.beyond is None else self.beyond
        return replace(self, low=low, high=high, beyond=None, below=None, places=(None, None))

    @property
    def is_part(self) -> bool:
        """Return whether values lie outside of the range."""
        return self.beyond is not None or self.below is not None

    def said(self, unit: str | None = None, length: str | None = None) -> str:
        """Return for the legend what the range is; "" where it is that of all values.

        unit: that of the values. length: that of places.
        """
        ends = [
            f"{name} {value:.4g}{f' {unit}' if unit else ''}{_at(place, length)}"
            for name, value, place in zip(("largest", "least"), (self.beyond, self.below), self.places, strict=True)
            if value is not None
        ]
        where = " away from singular places" if self.without else ""
        return f"{100.0 * SHOWN:g} % of the body{where}; {', '.join(ends)}" if ends else ""

    def norm(self) -> "Normalize":
        """Return the range as a new object of matplotlib, which maps values to 0..1; colour bars change theirs."""
        from matplotlib.colors import LogNorm, Normalize

        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high, clip=True)

    def shares(self, values: Array) -> Array:
        """Return the places of values in the range, 0..1; 0.5 where the field has one value."""
        if self.remark:
            return np.full(np.shape(values), 0.5)
        inside, ends = np.clip(values, self.low, self.high), np.array([self.low, self.high])
        if self.logarithmic:
            inside, ends = np.log10(inside), np.log10(ends)
        return np.asarray((inside - ends[0]) / (ends[1] - ends[0]))

    def colors(self, values: Array) -> Array:
        """Return red, green, blue (..., 3) of values (...)."""
        return shaded(self.shares(values))


def _at(place: Sequence[float] | None, length: str | None) -> str:
    """Return a place in words; coordinates that are tiny beside the others are 0."""
    if place is None:
        return ""
    tiny = TINY * max(map(abs, place))
    return f" at ({', '.join(f'{x if abs(x) > tiny else 0.0:.4g}' for x in place)}){f' {length}' if length else ''}"


def even_range(values: Sequence[Array]) -> ColorRange:
    """Return the range from the lowest to the highest of all values."""
    low, high = min(float(patch.min()) for patch in values), max(float(patch.max()) for patch in values)
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(size))
    if high - low <= ROUNDING * size:
        return ColorRange(0.0, 1.0, remark=f"{high:.4g} everywhere")
    return ColorRange(low, high)


def range_of_most(values: Sequence[Array], weights: Array, *, counted: Mask | None = None) -> ColorRange:
    """Return the range of SHOWN of the body, at an end where the rest would take a fifth of the colours; else all.

    values: arrays of samples, of which the last has the samples that count, with their volumes as weights. counted:
    whether a sample counts, by default all do. At each end the range leaves out half of the rest.
    """
    whole = even_range(values)
    if whole.remark or whole.high - whole.low < SOLVED * max(abs(whole.high), abs(whole.low)):
        return whole
    mask = np.ones(weights.shape, dtype=bool) if counted is None or not counted.any() else counted
    order = np.argsort(inside := values[-1][mask])
    shares = np.cumsum(weights[mask][order])
    ends = np.searchsorted(shares, shares[-1] * np.array([OUTSIDE, 1.0 - OUTSIDE]))
    low, high = inside[order][np.minimum(ends, len(order) - 1)].tolist()
    least = WORTH * (whole.high - whole.low) if counted is None else 0.0  # near singular places values are no result
    peaked, sunk = whole.high - high > least, low - whole.low > least
    found = replace(whole, low=low if sunk else whole.low, high=high if peaked else whole.high)
    if not found.high > found.low:
        return whole
    beyond, below = whole.high if peaked else None, whole.low if sunk else None
    return replace(found, beyond=beyond, below=below)


def joint_range(limits: Sequence[ColorRange], values: Sequence[Array]) -> ColorRange:
    """Return one range of several fields with even ranges. values: those of all of them."""
    whole = even_range(values)
    if whole.remark or not any(one.is_part for one in limits):
        return whole
    shown = [one for one in limits if not one.remark]
    low, high = min(one.low for one in shown), max(one.high for one in shown)
    beyond, below = whole.high if high < whole.high else None, whole.low if low > whole.low else None
    return replace(whole, low=low, high=high, beyond=beyond, below=below)


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
