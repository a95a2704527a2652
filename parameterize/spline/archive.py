"""Writes and reads the patches of a body, or of fields on it, in one .npz.

Each array has the patch before its name: p0_degrees, p0_knots_u, .., p1_degrees, .. Of many patches those with equal
degrees and knots are one array, with the group before its name: g0_patches (k,) the numbers of its patches, g0_degrees,
g0_knots_u, .. once for all of them, and all other arrays with one row a patch, such as g0_control_points (k, n_u, ..).
Rational patches also have weights. A row of `interfaces` has seven whole numbers, see interface_rows.py. A body of
several solids has `solids`, the number of each patch's solid, and `solid_names`.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..arrays import Array, Floats
from ..files import array_names, load_arrays, save_arrays
from .interface import Interface
from .interface_rows import COLUMNS, interfaces_of, rows_of
from .solids import PatchSolids
from .volume import AXES, FACE_NAMES, BSplineVolume

MOST_APART = 1000  # patches with arrays of their own: a file of more arrays takes long to write and read
BASIS = ("degrees", *(f"knots_{axis}" for axis in AXES))  # what the patches of a group have in common

PatchArrays = Mapping[str, Floats]  # of one patch, by their names: those of BASIS and others


def save_patches(
    path: str | Path, patches: Sequence[BSplineVolume], interfaces: Sequence[Interface], solids: PatchSolids
) -> None:
    """Write patches, interfaces and, where there are several solids or names, the solid of each patch; atomic."""
    arrays = named_arrays([_arrays(patch) for patch in patches])
    save_arrays(path, interfaces=rows_of(interfaces), **arrays, **_solid_arrays(solids))


def _solid_arrays(solids: PatchSolids) -> dict[str, Floats]:
    """Return the arrays of the solids of patches by their names in a file; none of one solid without a name."""
    return {} if solids.is_plain else {"solids": solids.numbers, "solid_names": np.array(solids.names, dtype=np.str_)}


def load_solids(path: str | Path) -> PatchSolids:
    """Read the solids of patches, all of one where the file has none. Raises ValueError as `PatchSolids`."""
    arrays = load_arrays(path, (), ("solids", "solid_names"))
    names = tuple(map(str, arrays.get("solid_names", np.empty(0)).ravel().tolist()))
    return PatchSolids(arrays["solids"], names) if "solids" in arrays else PatchSolids()


def _arrays(patch: BSplineVolume) -> PatchArrays:
    basis = dict(zip(BASIS, (np.array(patch.degrees), *patch.knots), strict=True))
    weights = {} if patch.weights is None else {"weights": patch.weights}
    return {**basis, "control_points": patch.control_points, **weights}


def load_patches(path: str | Path) -> tuple[tuple[BSplineVolume, ...], tuple[Interface, ...]]:
    """Read patches and interfaces. Raises FileNotFoundError, or ValueError that names the defect of the file."""
    patches = []
    for number, arrays in enumerate(load_patch_arrays(path, ("control_points",), ("weights",))):
        degrees, u, v, w = (arrays[name] for name in BASIS)
        try:
            patch = BSplineVolume(tuple(degrees.tolist()), (u, v, w), arrays["control_points"], arrays.get("weights"))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: patch {number}: {error}") from None
        patches.append(patch)
    rows = load_arrays(path, ("interfaces",))["interfaces"]
    if rows.ndim != 2 or rows.shape[1] != COLUMNS or rows.dtype.kind not in "iu":
        raise ValueError(f"{path}: interfaces must have {COLUMNS} whole numbers a row")
    if not np.isin(rows[:, [1, 3]], np.arange(len(FACE_NAMES))).all():
        raise ValueError(f"{path}: interfaces name a face that there is not: faces are 0 to {len(FACE_NAMES) - 1}")
    return tuple(patches), interfaces_of(rows)


def is_of_patches(path: str | Path) -> bool:
    """Return whether an .npz holds the patches of a body, rather than one volume. Raises as `load_patches`."""
    return "interfaces" in array_names(path)


def named_arrays(patches: Sequence[PatchArrays]) -> dict[str, Array]:
    """Return the arrays of patches by their names in a file."""
    if len(patches) <= MOST_APART:
        return {f"p{number}_{name}": array for number, own in enumerate(patches) for name, array in own.items()}
    members = defaultdict(list)
    for number, own in enumerate(patches):
        alike = ((name, array.shape, array.tobytes() if name in BASIS else b"") for name, array in own.items())
        members[tuple(alike)].append(number)
    found = {}
    for group, numbers in enumerate(members.values()):
        found[f"g{group}_patches"] = np.array(numbers)
        for name, array in patches[numbers[0]].items():
            together = array if name in BASIS else np.stack([patches[number][name] for number in numbers])
            found[f"g{group}_{name}"] = together
    return found


def load_patch_arrays(path: str | Path, names: Sequence[str], extra: Sequence[str] = ()) -> list[PatchArrays]:
    """Read the arrays of patches: those of BASIS, the named ones and, where a patch has them, those of `extra`.

    Raises FileNotFoundError, or ValueError that names the defect of the file.
    """
    held = array_names(path)
    kind, own = (
        ("g", ("patches", *BASIS, *names)) if any(name.startswith("g0_") for name in held) else ("p", (*BASIS, *names))
    )
    numbers = [int(found[1]) for name in held if (found := re.match(rf"{kind}(\d+)_", name))]
    before = [f"{kind}{number}_" for number in range(max(numbers, default=-1) + 1)]
    wanted, further = (tuple(start + name for start in before for name in some) for some in (own, extra))
    data = load_arrays(path, wanted, further)
    rows: list[PatchArrays] = [
        {name: data[start + name] for name in (*own, *extra) if start + name in data} for start in before
    ]
    return rows if kind == "p" else _ungrouped(path, rows)


def _ungrouped(path: str | Path, groups: Sequence[PatchArrays]) -> list[PatchArrays]:
    """Return the arrays of each patch from those of groups. Raises ValueError for patches missing or given twice."""
    numbers = np.concatenate([group["patches"].ravel() for group in groups])
    each = [row for group in groups for row in _rows(group)]
    if numbers.dtype.kind not in "iu" or not np.array_equal(np.sort(numbers), np.arange(len(each))):
        raise ValueError(f"{path}: each patch must be in one group, with one row in each array of the group")
    return [each[place] for place in np.argsort(numbers)]


def _rows(group: PatchArrays) -> Iterator[PatchArrays]:
    """Yield the arrays of each patch of a group; none if their numbers of rows differ."""
    basis = {name: group[name] for name in BASIS}
    others = {name: np.atleast_1d(array) for name, array in group.items() if name not in BASIS}
    if len({len(array) for array in others.values()}) == 1:
        for own in zip(*others.values(), strict=True):
            yield basis | dict(zip(others, own, strict=True))
