"""Chooses the colours in which the faces of a body are told apart: a volume's six faces, or the patches of several."""

from collections.abc import Sequence

from matplotlib import colormaps
from matplotlib.colors import to_hex

from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

from .evaluate import FACE_COLORS, face_labels

PATCH_COLORS = tuple(to_hex(color) for color in colormaps["tab20"].colors)  # type: ignore[attr-defined]
NAMED = 4  # patches of one colour that its label names


def face_colors(body: BodyLike) -> list[str]:
    """Return the colours of six faces of each patch: those of the faces of a volume; of several each patch has one."""
    glued = as_body(body)
    if glued.is_single:
        return list(FACE_COLORS)
    return [PATCH_COLORS[i % len(PATCH_COLORS)] for i in range(len(glued)) for _ in FACE_NAMES]


def color_labels(body: BodyLike) -> list[tuple[str, str]]:
    """Return the legend of the colours: each with a label such as "u0: u = 0", of several patches such as "p3, p23"."""
    glued = as_body(body)
    if glued.is_single:
        return list(zip(FACE_COLORS, face_labels(), strict=True))
    names = [f"p{i}" for i in range(len(glued))]
    alike = [names[i :: len(PATCH_COLORS)] for i in range(min(len(names), len(PATCH_COLORS)))]
    return [(color, _shortened(each)) for color, each in zip(PATCH_COLORS, alike, strict=False)]


def _shortened(names: Sequence[str]) -> str:
    return ", ".join([*names[:NAMED], "…"] if len(names) > NAMED else names)
