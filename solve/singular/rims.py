"""Finds the rims of held regions inside faces of patches: where the conditions that hold change between two points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body
from parameterize.spline.volume import FACE_NAMES

from .edges import ACROSS, INSET, outward
from .held import Supports

_FIRST = 6  # samples a direction of a face of many, before those are chosen that a rim crosses
_MANY = 60  # faces from which on this is worth it
_PER_SPAN = 4  # samples a span and direction: rims that are thinner may be missed
_MOST = 129  # samples a direction
_BISECTIONS = 12


@dataclass(frozen=True, eq=False)
class HeldRim:
    """Hold points (m, 3) of rims, sides (m, 3, 3) of the spans there, and the number (m,) of the condition."""

    points: Array
    spans: Array
    names: IntArray


def rims_in_faces(body: Body, supports: Supports, breaks: Sequence[Sequence[Array]], differ: float) -> HeldRim:
    """Return the rims of conditions inside faces; those along edges are left out.

    breaks: the breakpoints of each direction of each patch. differ: the norm of the difference of two projectors from
    which on points are held in different ways.
    """
    faces = np.flatnonzero(~body.glued.ravel())
    if len(faces) > _MANY:
        faces = faces[[len(np.unique(codes)) > 1 for codes in _sampled(body, supports, faces, _FIRST, _FIRST)]]
    counts = np.array([_counts(breaks, face) for face in faces.tolist()], dtype=np.int64).reshape(-1, 2)
    parts = [HeldRim(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0, dtype=np.int64))]
    for count in np.unique(counts, axis=0):
        own = faces[(counts == count).all(axis=1)]
        codes = _sampled(body, supports, own, int(count[0]), int(count[1]))
        for direction in (0, 1):
            parts.append(_crossings(body, supports, breaks, own, codes, direction, differ))
    return HeldRim(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "spans", "names")))


def _counts(breaks: Sequence[Sequence[Array]], face: int) -> list[int]:
    """Return the number of samples of both directions along a face."""
    patch, number = divmod(face, len(FACE_NAMES))
    spans = [len(breaks[patch][a]) - 1 for a in ACROSS[number // 2]]
    return [min(max(_FIRST, _PER_SPAN * count + 1), _MOST) for count in spans]


def _samples(count: int) -> Array:
    return np.linspace(INSET, 1.0 - INSET, count)


def _sampled(body: Body, supports: Supports, faces: IntArray, first: int, second: int) -> IntArray:
    """Return the codes (k, first, second) on a grid of each of k faces."""
    grid = np.stack(np.meshgrid(_samples(first), _samples(second), indexing="ij"), axis=-1).reshape(-1, 2)
    owners = np.repeat(faces, len(grid))
    return _codes(body, supports, owners, np.tile(grid, (len(faces), 1)))[0].reshape(-1, first, second)


def _codes(body: Body, supports: Supports, faces: IntArray, along: Array) -> tuple[IntArray, Array, Array]:
    """Return codes (m,), points (m, 3) and normals (m, 3) at parameters (m, 2) along faces (m,)."""
    x, normal = outward(body, faces, _parameters(faces, along))
    return supports.codes(faces, np.ascontiguousarray(x.T), np.ascontiguousarray(normal.T)), x, normal


def _parameters(faces: IntArray, along: Array) -> Array:
    axes, sides = np.divmod(faces % len(FACE_NAMES), 2)
    found, each = np.empty((len(faces), 3)), np.arange(len(faces))
    found[each, axes] = sides
    found[each[:, None], ACROSS[axes]] = along
    return found


def _crossings(
    body: Body,
    supports: Supports,
    breaks: Sequence[Sequence[Array]],
    faces: IntArray,
    codes: IntArray,
    direction: int,
    differ: float,
) -> HeldRim:
    """Return the points between neighbouring samples along a direction, 0 or 1, whose codes (k, a, b) differ."""
    rows = [_samples(count) for count in codes.shape[1:]]
    k, i, j = np.nonzero(np.diff(codes, axis=1 + direction))
    low = np.stack([rows[0][i], rows[1][j]], axis=1)
    high = np.stack([rows[0][i + 1], rows[1][j]] if direction == 0 else [rows[0][i], rows[1][j + 1]], axis=1)
    own, start = faces[k], codes[k, i, j]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        is_low = (_codes(body, supports, own, middle)[0] == start)[:, None]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    before, after = _codes(body, supports, own, low), _codes(body, supports, own, high)
    held = [supports.projectors(code, normal.T) for code, _, normal in (before, after)]
    is_rim = np.linalg.norm(held[0] - held[1], axis=(-2, -1)) > differ
    changed = (before[0] ^ after[0])[is_rim]
    lowest = np.round(np.log2(np.maximum(changed & -changed, 1))).astype(np.int64)
    sides = _sides(body, breaks, own[is_rim], low[is_rim])
    return HeldRim(0.5 * (before[1] + after[1])[is_rim], sides, lowest)


def _sides(body: Body, breaks: Sequence[Sequence[Array]], faces: IntArray, along: Array) -> Array:
    """Return the sides (m, 3, 3), columns, of the spans at parameters along faces."""
    parameters, patches = _parameters(faces, along), faces // len(FACE_NAMES)
    spans = np.empty((len(faces), 3))
    for row, (patch, place) in enumerate(zip(patches.tolist(), parameters, strict=True)):
        for a, own in enumerate(breaks[patch]):
            last = min(max(int(np.searchsorted(own, place[a], side="right")), 1), len(own) - 1)
            spans[row, a] = own[last] - own[last - 1]
    return body.jacobian(patches, parameters) * spans[:, None]
