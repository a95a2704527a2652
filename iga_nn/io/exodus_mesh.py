"""Reads the solid elements of Exodus files, in double precision, with their numbers; blocks become groups.

Exodus stands on netCDF. Files of its classic kind are read by SciPy, those on HDF5 by netCDF4, where that is installed.
VTK reads both, but in single precision, in which neighbours would no longer fit together.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.meshes.kinds import ElementKind, kind_named
from parameterize.meshes.mesh import Block, VolumeMesh

CLASSIC = (b"CDF\1", b"CDF\2")
HDF5 = b"\x89HDF\r\n\x1a\n"
SHAPES = {"HEX": "hexahedron", "TET": "tetra", "WED": "wedge", "PYR": "pyramid"}
# Of VTK's nodes their places among those of Exodus: the upright edges come before those on top; the inner node before
# the faces -z, z, -x, x, -y, y.
HEX20 = [*range(12), *range(16, 20), *range(12, 16)]
HEX27 = [*HEX20, 23, 24, 25, 26, 21, 22, 20]
ORDERS = {"hexahedron20": HEX20, "hexahedron27": HEX27}
DAMAGED = "the file is damaged, or no Exodus file; export it again"


def read_exodus_mesh(path: Path) -> VolumeMesh | None:
    """Return the solid elements of a file, None where there are none. Raises ValueError for a bad one."""
    with _opened(path) as variables:
        try:
            return _mesh(variables)
        except (KeyError, IndexError, TypeError, AttributeError, OverflowError, OSError):
            raise ValueError(DAMAGED) from None


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Yield the variables of a netCDF file by their names."""
    with path.open("rb") as stream:
        head = stream.read(8)
    if head.startswith(CLASSIC):
        from scipy.io import netcdf_file

        try:
            file: Any = netcdf_file(path, "r", mmap=False)
        except (ValueError, TypeError, IndexError, KeyError, OverflowError, AssertionError, AttributeError):
            raise ValueError(DAMAGED) from None
    elif head == HDF5:
        if not find_spec("netCDF4"):
            raise ValueError("is an Exodus file on HDF5: install netCDF4 to read it, or save it in the classic format")
        from netCDF4 import Dataset

        file = Dataset(path)
    else:
        raise ValueError(DAMAGED)
    try:
        yield file.variables
    finally:
        file.close()


def _mesh(variables: Any) -> VolumeMesh | None:
    """Return the mesh of a file's variables."""
    points = _points(variables)
    rows: dict[ElementKind, list[tuple[IntArray, IntArray, str]]] = {}
    unchecked: dict[str, int] = {}
    names = _texts(variables["eb_names"][:]) if "eb_names" in variables else []
    count, block = 0, 0
    total = max(
        [int(v) for v in (re.sub(r"\D", "", name) for name in variables if name.startswith("connect")) if v] or [0]
    )
    connects = [f"connect{k}" for k in range(1, total + 1) if f"connect{k}" in variables]
    sizes = [len(variables[name][:]) for name in connects]
    known = next((name for name in ("elem_num_map", "elem_map") if name in variables), None)
    numbers = _whole(variables[known][:]) if known else 1 + np.arange(sum(sizes))
    for block, (name, size) in enumerate(zip(connects, sizes, strict=True)):
        nodes = _whole(variables[name][:])
        own, count = numbers[count : count + size], count + size
        given = variables[name].elem_type
        shape = SHAPES.get((given.decode() if isinstance(given, bytes) else given).strip().upper()[:3])
        if shape is None or not size:
            continue
        full = f"{shape}{nodes.shape[1]}"
        try:
            kind = kind_named(full)
        except ValueError:
            unchecked[full] = unchecked.get(full, 0) + size
            continue
        label = names[block] if block < len(names) and names[block] else f"block{block + 1}"
        rows.setdefault(kind, []).append((nodes[:, ORDERS.get(full, slice(None))] - 1, own, label))
    if not rows and not unchecked:
        return None
    blocks, groups, first = [], dict[str, IntArray](), 0
    for kind, parts in rows.items():
        blocks.append(Block(kind, np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])))
        for nodes, _, label in parts:
            groups[label] = first + np.arange(len(nodes))
            first += len(nodes)
    return VolumeMesh(points, tuple(blocks), unchecked, groups)


def _points(variables: Any) -> Array:
    if "coord" in variables:  # of older files: one table
        return np.array(variables["coord"][:], dtype=np.float64).T
    return np.stack([np.array(variables[f"coord{axis}"][:], dtype=np.float64) for axis in "xyz"], axis=1)


def _whole(values: Any) -> IntArray:
    return np.array(values, dtype=np.int64)


def _texts(rows: Any) -> list[str]:
    """Return rows of characters as texts."""
    words = (b"".join(np.ma.filled(row, b"").astype("S1").tolist()) for row in rows)
    return [word.split(b"\0")[0].decode(errors="replace").strip() for word in words]
