"""Writes and reads the patches of a body in one .npz: p0_degrees, p0_knots_u, .., p1_degrees, .., and `interfaces`.

Rational patches also have p0_weights, ..

A row of `interfaces` has seven whole numbers, see interface_rows.py.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..arrays import Array
from ..files import array_names, load_arrays, save_arrays
from .interface import Interface
from .interface_rows import COLUMNS, interfaces_of, rows_of
from .volume import AXES, FACE_NAMES, BSplineVolume


def save_patches(path: str | Path, patches: Sequence[BSplineVolume], interfaces: Sequence[Interface]) -> None:
    """Write patches and interfaces; atomic."""
    arrays: dict[str, Array] = {}
    for number, patch in enumerate(patches):
        parts = dict(zip(_names(), (np.array(patch.degrees), *patch.knots, patch.control_points), strict=True))
        arrays |= {f"p{number}_{name}": array for name, array in parts.items()}
        if patch.weights is not None:
            arrays[f"p{number}_weights"] = patch.weights
    save_arrays(path, interfaces=rows_of(interfaces), **arrays)


def load_patches(path: str | Path) -> tuple[tuple[BSplineVolume, ...], tuple[Interface, ...]]:
    """Read patches and interfaces. Raises FileNotFoundError, or ValueError that names the defect of the file."""
    count = sum(name.endswith("_degrees") for name in array_names(path))
    names = [f"p{number}_{name}" for number in range(count) for name in _names()]
    data = load_arrays(path, ("interfaces", *names), tuple(f"p{number}_weights" for number in range(count)))
    patches = []
    for number in range(count):
        degrees, *knots, points = (data[f"p{number}_{name}"] for name in _names())
        try:
            u, v, w = knots
            weights = data.get(f"p{number}_weights")
            patches.append(BSplineVolume(tuple(degrees.tolist()), (u, v, w), points, weights))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: patch {number}: {error}") from None
    rows = data["interfaces"]
    if rows.ndim != 2 or rows.shape[1] != COLUMNS or rows.dtype.kind not in "iu":
        raise ValueError(f"{path}: interfaces must have {COLUMNS} whole numbers a row")
    if not np.isin(rows[:, [1, 3]], np.arange(len(FACE_NAMES))).all():
        raise ValueError(f"{path}: interfaces name a face that there is not: faces are 0 to {len(FACE_NAMES) - 1}")
    return tuple(patches), interfaces_of(rows)


def is_of_patches(path: str | Path) -> bool:
    """Return whether an .npz holds the patches of a body, rather than one volume. Raises as `load_patches`."""
    return "interfaces" in array_names(path)


def _names() -> tuple[str, ...]:
    return ("degrees", *(f"knots_{axis}" for axis in AXES), "control_points")
