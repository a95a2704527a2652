"""Interfaces of thousands of patches at once: as rows of whole numbers, by kinds, and the gaps between their faces.

A row has seven whole numbers: patch and face of the one side, patch and face of the other, whether the axes are
exchanged, and which of them are reversed, as in `Interface`. Faces count as in FACE_NAMES.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product

import numpy as np

from ..arrays import Array, IntArray
from .interface import WEIGHT_TOLERANCE, Face, Interface, face_layer, knots_agree
from .patch_groups import PatchGroup
from .volume import FACE_NAMES

COLUMNS = 7
_FACE_NUMBERS = {name: number for number, name in enumerate(FACE_NAMES)}


def rows_of(interfaces: Iterable[Interface]) -> IntArray:
    """Return interfaces as rows (k, 7)."""
    return np.array([_row(interface) for interface in interfaces], dtype=np.int64).reshape(-1, COLUMNS)


def interfaces_of(rows: IntArray) -> tuple[Interface, ...]:
    """Return the interfaces of rows (k, 7)."""
    return tuple(_interface(*row) for row in rows.tolist())


def _row(interface: Interface) -> tuple[int, ...]:
    (p, face_p), (q, face_q) = interface.first, interface.second
    faces = _FACE_NUMBERS[face_p], _FACE_NUMBERS[face_q]
    return p, faces[0], q, faces[1], int(interface.swapped), *map(int, interface.flipped)


def _interface(p: int, face_p: int, q: int, face_q: int, swapped: int, a: int, b: int) -> Interface:
    first, second = (p, FACE_NAMES[face_p]), (q, FACE_NAMES[face_q])
    return Interface(first, second, bool(swapped), (bool(a), bool(b)))


def kinds(rows: IntArray, labels: IntArray) -> Iterator[tuple[Interface, IntArray]]:
    """Yield the rows (k, 7) that join equal faces of patches with equal labels in the same way, by their numbers (m,).

    labels: (patches,) such as the number of each patch's group. Each kind comes with the Interface that has the labels
    in place of the patches.
    """
    alike = rows.copy()
    alike[:, [0, 2]] = labels[rows[:, [0, 2]]]
    order = np.lexsort(alike.T)
    begins = np.flatnonzero(np.diff(alike[order], axis=0).any(axis=1)) + 1
    for members in np.split(order, begins) if len(rows) else ():
        yield _interface(*alike[members[0]].tolist()), members


def gaps(groups: Sequence[PatchGroup], rows: IntArray) -> Array:
    """Return the largest distance (k,) of two control points that should be one, of each of the rows (k, 7).

    It is infinite for faces with other degrees or knots, and where the weights of the two faces differ by more than a
    factor.
    """
    labels, places = group_places(groups)
    found = np.full(len(rows), np.inf)
    for kind, members in kinds(rows, labels):
        if knots_agree(groups, kind):
            found[members] = _gaps(groups, kind, places[rows[members, 0]], places[rows[members, 2]])
    return found


def group_places(groups: Sequence[PatchGroup]) -> tuple[IntArray, IntArray]:
    """Return the group of each patch of a body, and its place in the group: (patches,) each."""
    labels, places = np.empty((2, sum(map(len, groups))), dtype=np.int64)
    for label, group in enumerate(groups):
        labels[group.numbers], places[group.numbers] = label, np.arange(len(group))
    return labels, places


def _gaps(groups: Sequence[PatchGroup], kind: Interface, first: IntArray, second: IntArray) -> Array:
    """Return the gaps (m,) of interfaces of one kind between the patches at places (m,) of their groups."""
    one, other = _nets(groups, kind.first, first), kind.turned(_nets(groups, kind.second, second))
    factors = one[..., 3] / other[..., 3]
    differ = factors.max(axis=(0, 1)) > (1.0 + WEIGHT_TOLERANCE) * factors.min(axis=(0, 1))
    distances = np.linalg.norm((one - other)[..., :3], axis=-1).max(axis=(0, 1))
    return np.where(differ, np.inf, distances)


def _nets(groups: Sequence[PatchGroup], face: Face, places: IntArray) -> Array:
    """Return the control points of a face with their weights, (n_a, n_b, m, 4), of patches (m,) of a group."""
    label, name = face
    points = face_layer(np.moveaxis(groups[label].control_points, 0, 3), name)[:, :, places]
    if (weights := groups[label].weights) is None:
        return np.concatenate([points, np.ones((*points.shape[:3], 1))], axis=-1)
    return np.concatenate([points, face_layer(np.moveaxis(weights, 0, 3), name)[:, :, places, None]], axis=-1)


def face_numbers(rows: IntArray) -> IntArray:
    """Return the numbers (k, 2) of the two faces of rows (k, 7): 6 * patch + face."""
    return np.asarray(len(FACE_NAMES) * rows[:, [0, 2]] + rows[:, [1, 3]])


def oriented(groups: Sequence[PatchGroup], pairs: IntArray, tolerance: float) -> tuple[IntArray, IntArray]:
    """Return pairs of faces (k, 2) that lie on each other as rows (m, 7), in their order, and the numbers of the rest.

    pairs: of faces 6 * patch + face. Faces whose control points are no farther apart than the tolerance lie on each
    other; of several ways the first is taken.
    """
    ends = np.stack(np.divmod(pairs, len(FACE_NAMES)), axis=-1).reshape(-1, 4)
    rows = np.concatenate([ends, np.zeros((len(ends), 3), dtype=np.int64)], axis=1)
    left = np.arange(len(rows))
    for way in product((0, 1), repeat=3):
        rows[left, 4:] = way
        left = left[~(gaps(groups, rows[left]) <= tolerance)]
    return np.delete(rows, left, axis=0), left
