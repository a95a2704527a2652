"""Lays blocks along a skeleton: a thin start inside a body with handles or limbs."""

import logging
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...arrays import Array, IntArray, in_brackets
from ...certificate.boundary import check_boundary
from ...surface.solid import Solid
from ..complex import Complex, Vertices
from ..skeleton.graph import Skeleton
from .block_builder import BlockBuilder
from .centering import centered
from .merging import merge
from .rods import PARTS, Rod
from .rows import LimbRow, with_rows
from .splitting import split
from .strips import Crossing, cut_into_strips

_log = logging.getLogger(__name__)

SPANS = 6  # across each block
_LONGEST = 4  # times the spans across: those along a rod at most
_STRETCH = 2.0  # how long a span along a rod is, over one across the body: little changes along a rod
_REPAIRS = 60  # rounds in which what is folded, leaves the body or meets another part is made thinner


class LayoutError(ValueError):
    """Says in one line why no start of blocks fits into a body, and what can be done."""


def blocks_along(
    skeleton: Skeleton,
    vertices: Array,
    faces: IntArray,
    spans: int = SPANS,
    where: Callable[[Array], str] = in_brackets,
) -> Complex:
    """Return a thin start inside a body: rods along the branches of its skeleton, a block at each junction.

    Limbs have closed ends in their tips. The faces that are not glued form one closed surface of the body's genus.

    Parameters
    ----------
    skeleton : Skeleton
        Of the body, in the units of the surface.
    vertices : (n, 3) array
        Of the surface.
    faces : (m, 3) array of int
        Its triangles, wound outward.
    spans : int
        Of the knot vectors across each block; along a rod there are more where it is long.
    where : function
        Turns a place (3,) into words for messages, such as its coordinates in the user's units.

    Raises
    ------
    LayoutError
        For a skeleton without branches, and where blocks stay folded, outside or in each other, however thin.
    """
    if not skeleton.branches:
        raise LayoutError("the skeleton is a single point, without limbs or handles: one cube serves such a body")
    body = Solid(vertices, faces)
    merged = merge(centered(skeleton, body), body)
    in_rows, rows = with_rows(merged, body)
    for row in rows.values():
        _log.info("%d limbs side by side: a row, and a strip of the flat part for each", len(row.limbs))
    if rows:
        try:
            return _laid(in_rows, rows, body, spans, where)
        except LayoutError as error:
            _log.info("without rows of limbs: %s", error)
    return _laid(merged, {}, body, spans, where)


def _laid(
    skeleton: Skeleton, rows: Mapping[int, LimbRow], body: Solid, spans: int, where: Callable[[Array], str]
) -> Complex:
    """Return the start of blocks along a skeleton with some rows of limbs."""
    draft = BlockBuilder(split(skeleton, body, rows), body, rows)
    for _ in range(_REPAIRS):
        faults = draft.repaired()
        if faults:
            continue
        blocks, drafted = _blocks(draft, spans)
        met = check_boundary(blocks.body).meeting
        if met is None:
            return blocks
        draft.thin_near(np.array(met.point), tuple(drafted[number] for number in met.patches or ()))
        faults = [("two rods meet", np.array(met.point))]
    what, place = faults[0]
    raise LayoutError(
        f"no start of blocks fits into the body: {what} near {where(place)}; make the surface wider there"
    )


def _blocks(draft: BlockBuilder, spans: int) -> tuple[Complex, list[int]]:
    """Return the blocks of a draft, and the number that each had before flat parts were cut into strips.

    The junctions come first, then the rods, and last the limbs of rows, which begin on strips.
    """
    vertices, rows = Vertices(), list(draft.strips())
    limbs = [limb for _, _, own in rows for limb in own]
    junctions = {node: vertices.add(draft.corners(node)) for node in draft.junctions}
    sections = {f"junction {node}": corners for node, corners in junctions.items()}
    counts = [(spans,) * 3] * len(sections)
    for number in draft.rods:
        if number not in limbs:
            parts = _rod(draft, number, vertices, draft.ends(number, junctions, {}))
            sections |= parts
            counts += [(spans, spans, _spans_along(draft.rods[number], len(parts), spans))] * len(parts)
    whole = Complex.of(vertices.array, sections, counts)
    begun = [(whole.names.index(f"rod {stem}"), cuts) for (stem, _), cuts, _ in rows]
    if not begun:
        return whole, list(range(len(whole)))
    try:
        blocks, owners = cut_into_strips(whole, begun)
    except Crossing:
        raise LayoutError("no start of blocks fits into the body: two rows of limbs share a flat part") from None
    vertices, strips = Vertices(blocks.points), dict[int, IntArray]()
    for ((_, end), _, own), (stem, _) in zip(rows, begun, strict=True):
        for limb, strip in zip(own, np.flatnonzero(owners == stem).tolist(), strict=True):
            face = blocks.sections(strip)[:, :, -1 if end else 0]
            strips[limb] = face if end else face.swapaxes(0, 1)
    sections = {name: blocks.sections(k) for k, name in enumerate(blocks.names)}
    counts = blocks.spans.tolist()
    for limb in (number for number in draft.rods if number in limbs):
        sections |= _rod(draft, limb, vertices, draft.ends(limb, junctions, strips))
        counts.append((spans, spans, _spans_along(draft.rods[limb], 1, spans)))
    return Complex.of(vertices.array, sections, counts), [*owners.tolist(), *range(len(whole), len(whole) + len(limbs))]


def _rod(draft: BlockBuilder, number: int, vertices: Vertices, ends: Sequence[IntArray | None]) -> dict[str, IntArray]:
    """Return the vertices (2, 2, m) of the sections of a rod, or of the parts of a ring; those inside are added.

    ends: the vertices (2, 2) of its first and last section, where these are known.
    """
    first, last = ends
    turned = draft.rings.get(number)
    places = draft.sections(number)[first is not None : None if last is None and turned is None else -1]
    rows = [*([] if first is None else [first]), *vertices.add(places), *([] if last is None else [last])]
    if turned is None:
        return {f"rod {number}": np.stack(rows, axis=-1)}
    sections = np.stack([*rows, np.rot90(rows[0], turned)], axis=-1)
    step = len(rows) // PARTS
    return {f"rod {number}, part {k}": sections[..., k * step : (k + 1) * step + 1] for k in range(PARTS)}


def _spans_along(rod: Rod, parts: int, spans: int) -> int:
    """Return the spans along a part of a rod: by its length over the body's width."""
    count = round(spans * rod.length / (parts * _STRETCH * rod.body_width))
    return int(np.clip(count, spans, _LONGEST * spans))
