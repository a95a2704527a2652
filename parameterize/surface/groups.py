"""Groups: named sets of the faces of a mesh, as files and meshes in memory give them.

A group is a row of face numbers, ascending; a face may be in several groups, or in none. Wherever faces get new
numbers, `renumbered` gives them to the groups, too.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import IntArray
from ..spline.solids import PatchSolids
from .errors import MeshError

Groups = Mapping[str, IntArray]  # name: numbers of faces, ascending

MOST_VALUES = 64  # of face data, for these to be groups
MOST_GROUPS = 1000
LONGEST_NAME = 80


def gathered(parts: Iterable[tuple[str, ArrayLike]]) -> dict[str, IntArray]:
    """Return groups from pairs of a name and face numbers; pairs of the same name make one group."""
    found: dict[str, list[IntArray]] = {}
    for name, numbers in parts:
        found.setdefault(" ".join(name.split())[:LONGEST_NAME], []).append(np.asarray(numbers, dtype=np.int64))
    united = {name: np.unique(np.concatenate(rows)) for name, rows in found.items()}
    return {name: numbers for name, numbers in united.items() if name and len(numbers)}


def by_value(arrays: Mapping[str, ArrayLike], count: int) -> dict[str, IntArray]:
    """Return a group "NAME=VALUE" for each value of the arrays of `count` whole numbers.

    Arrays of other sizes or types, of one value, or of more than `MOST_VALUES` give no groups.
    """
    parts = []
    for name, given in arrays.items():
        values = np.asarray(given)
        if values.shape != (count,) or values.dtype.kind not in "iub":
            continue
        distinct = np.unique(values)
        if 1 < len(distinct) <= MOST_VALUES:
            parts += [(f"{name}={int(value)}", np.flatnonzero(values == value)) for value in distinct]
    return gathered(parts)


def renumbered(groups: Groups, old: IntArray) -> dict[str, IntArray]:
    """Return the groups after the faces got new numbers; groups without faces are dropped.

    old: (m,), the former numbers of the present faces, -1 for a face that is new.
    """
    size = max(int(old.max(initial=-1)), *(int(numbers[-1]) for numbers in groups.values()), 0) + 1
    found = {}
    for name, numbers in groups.items():
        member = np.zeros(size + 1, dtype=bool)  # the last one stands for -1
        member[numbers] = True
        found[name] = np.flatnonzero(member[old])
    return {name: numbers for name, numbers in found.items() if len(numbers)}


def of_solids(names: tuple[str, ...], owners: IntArray) -> dict[str, IntArray]:
    """Return a group for each name of several solids, which `PatchSolids.labels` gives.

    owners: (m,), the solid of each face.
    """
    if len(names) < 2:
        return {}
    return gathered((name, np.flatnonzero(owners == k)) for k, name in enumerate(PatchSolids(owners, names).labels))


def checked(groups: Mapping[str, ArrayLike], count: int) -> dict[str, IntArray]:
    """Return the groups of `count` faces that a user or a file gives. Raises MeshError for numbers of no face."""
    for name, given in groups.items():
        numbers = np.asarray(given)
        if numbers.ndim != 1 or (numbers.size and numbers.dtype.kind not in "iu"):
            raise MeshError(f"group {name!r:.80} must be a row of face numbers, got {numbers.dtype} {numbers.shape}")
        if numbers.size and not 0 <= numbers.min() <= numbers.max() < count:
            raise MeshError(f"group {name!r:.80} must hold face numbers from 0 to {count - 1}")
    return gathered(groups.items())


def few(groups: Groups) -> tuple[Groups, tuple[str, ...]]:
    """Return groups and no notice; where there are too many, no groups and a notice."""
    if len(groups) <= MOST_GROUPS:
        return groups, ()
    return {}, (f"left out {len(groups)} groups of faces, more than {MOST_GROUPS}",)


def as_arrays(groups: Groups) -> dict[str, NDArray[Any]]:
    """Return groups as three arrays for an .npz file; `from_arrays` reads them."""
    return {
        "group_names": np.array(list(groups), dtype=np.str_),
        "group_sizes": np.array([len(numbers) for numbers in groups.values()], dtype=np.int64),
        "group_faces": np.concatenate([*groups.values(), np.empty(0, dtype=np.int64)]),
    }


def from_arrays(names: NDArray[Any], sizes: NDArray[Any], faces: NDArray[Any], count: int) -> dict[str, IntArray]:
    """Return the groups of `count` faces from the arrays of `as_arrays`. Raises MeshError for other arrays."""
    kinds = [(array.ndim, array.dtype.kind) for array in (names, sizes, faces)]
    if kinds != [(1, "U"), (1, "i"), (1, "i")] or len(names) != len(sizes) or sizes.min(initial=0) < 0:
        raise MeshError("the groups' names and sizes do not fit together")
    if sum(sizes.tolist()) != len(faces):
        raise MeshError(f"the groups hold {sum(sizes.tolist())} faces, {len(faces)} are given")
    parts = np.split(faces, np.cumsum(sizes)[:-1]) if len(sizes) else []
    return checked(dict(zip(names.tolist(), parts, strict=True)), count)
