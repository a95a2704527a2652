"""Chooses colours: of a volume's faces, of the patches of a body, and of a field's values, for figures and views alike.

Nothing here loads the figures of matplotlib, which take longer than a view is made in.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize, to_hex

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

MAP = "viridis"  # colour map; perceptually uniform
FACE_COLORS = ("#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee6677", "#aa3377")  # also distinct for the colour-blind
PATCH_COLORS = tuple(to_hex(color) for color in colormaps["tab20"].colors)  # type: ignore[attr-defined]
MOST_NAMED = 80  # patches: of more, too many have the same colour for a legend

DECADES = 1e-4  # lower end of a logarithmic range over the largest error of the best mesh
SMALLEST = 1e-200  # smaller fields have no ticks on their colour bar
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


@dataclass(frozen=True)
class ColorRange:
    """Hold the limits of a colour scale.

    remark: stands in place of ticks where the field has one value, such as "0 everywhere". beyond: the largest value of
    the field where it is higher than the range, as a stress near places where it is infinite; it has the last colour.
    """

    low: float
    high: float
    logarithmic: bool = False
    remark: str = ""
    beyond: float | None = None

    @property
    def whole(self) -> "ColorRange":
        """Return the range up to the largest value of the field."""
        return self if self.beyond is None else replace(self, high=self.beyond, beyond=None)

    def norm(self) -> Normalize:
        """Return the range as a new object of matplotlib, which maps values to 0..1; colour bars change theirs."""
        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high, clip=True)

    def shares(self, values: Array) -> Array:
        """Return the places of values in the range, 0..1; 0.5 where the field has one value."""
        if self.remark:
            return np.full(np.shape(values), 0.5)
        return np.asarray(self.norm()(np.ravel(values))).reshape(np.shape(values))

    def colors(self, values: Array) -> Array:
        """Return red, green, blue (..., 3) of values (...)."""
        return np.asarray(colormaps[MAP](self.shares(values)))[..., :3]


def even_range(values: Sequence[Array]) -> ColorRange:
    """Return the range from the lowest to the highest of all values."""
    low, high = min(float(patch.min()) for patch in values), max(float(patch.max()) for patch in values)
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(size))
    if high - low <= ROUNDING * size:
        return ColorRange(0.0, 1.0, remark=f"{high:.4g} everywhere")
    return ColorRange(low, high)


def range_up_to(high: float, values: Sequence[Array]) -> ColorRange:
    """Return the range from the lowest of all values to `high`, where some are higher and some lower."""
    whole = even_range(values)
    return replace(whole, high=high, beyond=whole.high) if not whole.remark and whole.low < high < whole.high else whole


def joint_range(limits: Sequence[ColorRange], values: Sequence[Array]) -> ColorRange:
    """Return one range of several fields with even ranges. values: those of all of them."""
    if all(one.beyond is None for one in limits):
        return even_range(values)
    return range_up_to(max(one.high for one in limits if not one.remark), values)


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
