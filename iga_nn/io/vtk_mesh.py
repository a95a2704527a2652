"""Reads the solid cells of .vtu files, and of .vtk and CGNS files by VTK: linear, quadratic, Lagrange, Bezier."""

import locale
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.meshes.kinds import SERENDIPITY, ElementKind, hexahedron, node_count, tetra
from parameterize.meshes.mesh import Block, VolumeMesh
from parameterize.surface.readers.vtu import grid_of

MAX_BYTES = 16 << 30  # that the arrays of a .vtu may unpack to
# VTK's readers may end the program where a file is damaged: they try it in another one first.
TRY = "import sys; from vtkmodules.{module} import {name}; r = {name}(); r.SetFileName(sys.argv[1]); r.Update()"
DAMAGED = "VTK does not read it: the file is damaged, or no such file; export it again"
READERS = {
    ".vtk": ("vtkIOLegacy", "vtkUnstructuredGridReader"),
    ".cgns": ("vtkIOCGNSReader", "vtkCGNSReader"),
}
FIXED = {10: tetra(1), 12: hexahedron(1), 11: hexahedron(1), 24: tetra(2), 25: SERENDIPITY, 29: hexahedron(2)}
VOXEL = [0, 1, 3, 2, 4, 5, 7, 6]  # VTK's voxels count x fastest
TETRAHEDRA, HEXAHEDRA = (71, 78), (72, 79)  # Lagrange, Bezier
BEZIER = (78, 79)
OTHERS = {13: "wedge", 14: "pyramid", 15: "pentagonal prism", 16: "hexagonal prism", 26: "wedge15", 27: "pyramid13"}
OTHERS |= {31: "wedge12", 32: "wedge18", 33: "hexahedron24", 37: "pyramid19", 42: "polyhedron", 73: "Lagrange wedge"}
OTHERS |= {74: "Lagrange pyramid", 80: "Bezier wedge", 81: "Bezier pyramid"}


def read_vtk_mesh(path: Path) -> VolumeMesh | None:
    """Return the solid cells of a file, numbered from 0, None where there are none. Raises ValueError for a bad one."""
    if path.suffix.lower() == ".vtk" and not _is_unstructured(path):
        return None
    grids = list(_pieces(path) if path.suffix.lower() == ".vtu" else _grids(path))
    if not any(len(types) for _, types, *_ in grids):
        return None
    found: dict[ElementKind, list[tuple[IntArray, IntArray]]] = {}
    unchecked: dict[str, int] = {}
    points, first, cells = [np.empty((0, 3))], 0, 0
    for places, types, offsets, corners, degrees, weights in grids:
        own = cells + np.arange(len(types))
        for kind, rows, nodes in _by_kind(types, offsets, corners, degrees):
            if isinstance(kind, str):
                unchecked[kind] = unchecked.get(kind, 0) + len(rows)
                continue
            if kind.is_bezier and weights is not None and (bent := _rational(weights[nodes])).any():
                unchecked[f"rational {kind}"] = unchecked.get(f"rational {kind}", 0) + int(bent.sum())
                rows, nodes = rows[~bent], nodes[~bent]
            found.setdefault(kind, []).append((first + nodes, own[rows]))
        points.append(places)
        first, cells = first + len(places), cells + len(types)
    if not found and not unchecked:
        return None
    blocks = (
        Block(kind, *(np.concatenate(arrays) for arrays in zip(*rows, strict=True))) for kind, rows in found.items()
    )
    return VolumeMesh(np.concatenate(points), tuple(blocks), unchecked)


def _is_unstructured(path: Path) -> bool:
    """Return whether a legacy file begins as one with cells of several kinds, or as none at all."""
    with path.open("rb") as stream:
        head = stream.read(1024).upper()
    return b"UNSTRUCTURED_GRID" in head or b"DATASET" not in head


def _rational(weights: Array) -> Any:
    """Return which rows (k, nodes) of weights are not all alike."""
    return np.ptp(weights, axis=1) > 1e-12 * weights.max(axis=1)


Grid = tuple[Array, IntArray, IntArray, IntArray, IntArray | None, Array | None]


def _pieces(path: Path) -> Iterator[Grid]:
    """Yield the pieces of a .vtu as `_grids` does; VTK's own reader may end the program where a file is damaged.

    Before version 2.1 of the format the last two upright edges of Lagrange and Bezier hexahedra changed places.
    """
    version, pieces = grid_of(path.read_bytes(), MAX_BYTES)
    numbers = re.match(r"(\d+)\.(\d+)", version)
    is_old = numbers is not None and (int(numbers[1]), int(numbers[2])) < (2, 1)
    for piece in pieces:
        offsets = np.append(0, piece.ends)
        corners = piece.corners
        if is_old:
            for row in np.flatnonzero(np.isin(piece.types, HEXAHEDRA)).tolist():
                own = corners[offsets[row] : offsets[row + 1]]
                degrees = _degrees_of(72, len(own)) if piece.degrees is None else piece.degrees[row].tolist()
                _exchange(own, degrees)
        yield piece.points, piece.types, offsets, corners, piece.degrees, piece.weights


def _exchange(nodes: IntArray, degrees: Sequence[int]) -> None:
    """Exchange the nodes of the last two edges of a hexahedron along w, in place."""
    p, q, r = degrees
    first, count = 8 + 4 * (p - 1) + 4 * (q - 1) + 2 * (r - 1), r - 1
    nodes[first : first + 2 * count] = np.roll(nodes[first : first + 2 * count], count)


def _grids(path: Path) -> Iterator[Grid]:
    """Yield the grids of a file: points, types, offsets and nodes of cells, their degrees and weights."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for grid in _leaves(_read(path)):
        if not grid.GetNumberOfCells():
            continue
        places = vtk_to_numpy(grid.GetPoints().GetData()).astype(np.float64)
        types = _cell_types(grid)
        held = grid.GetCells()
        offsets, corners = (
            vtk_to_numpy(array).astype(np.int64) for array in (held.GetOffsetsArray(), held.GetConnectivityArray())
        )
        data = grid.GetCellData()
        degrees = data.GetHigherOrderDegrees() or data.GetArray("HigherOrderDegrees")
        weights = grid.GetPointData().GetRationalWeights() or grid.GetPointData().GetArray("RationalWeights")
        yield (
            places,
            types.astype(np.int64),
            offsets,
            corners,
            None if degrees is None else vtk_to_numpy(degrees).astype(np.int64),
            None if weights is None else vtk_to_numpy(weights).astype(np.float64),
        )


def _cell_types(grid: Any) -> Any:
    """Return the types of a grid's cells; PyVista knows by which name each release of VTK has them."""
    from pyvista import UnstructuredGrid

    return UnstructuredGrid(grid).celltypes


def _read(path: Path) -> Any:
    """Return what VTK makes of a file; its messages become one line."""
    from importlib import import_module

    from vtkmodules.vtkCommonCore import vtkLogger, vtkObject

    module, name = READERS[path.suffix.lower()]
    tried = [sys.executable, "-c", TRY.format(module=module, name=name), str(path)]
    if subprocess.run(tried, capture_output=True, check=False).returncode:
        raise ValueError(DAMAGED)
    reader = getattr(import_module(f"vtkmodules.{module}"), name)()
    faults: list[str] = []
    reader.AddObserver("ErrorEvent", lambda *_: faults.append("error"))
    reader.SetFileName(str(path))
    shown, level = vtkObject.GetGlobalWarningDisplay(), vtkLogger.GetCurrentVerbosityCutoff()
    spoken = locale.setlocale(locale.LC_ALL)  # the reader leaves "C" behind: Python would open texts as ASCII
    vtkObject.SetGlobalWarningDisplay(0)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        reader.Update()
    finally:
        locale.setlocale(locale.LC_ALL, spoken)
        vtkObject.SetGlobalWarningDisplay(shown)
        vtkLogger.SetStderrVerbosity(level)
    found = reader.GetOutputDataObject(0)
    if faults or found is None:
        raise ValueError(DAMAGED)
    return found


def _leaves(found: Any) -> Iterator[Any]:
    """Yield the unstructured grids in what VTK read."""
    if found.IsA("vtkUnstructuredGrid"):
        yield found
    elif found.IsA("vtkMultiBlockDataSet") or found.IsA("vtkPartitionedDataSetCollection"):
        walk = found.NewIterator()
        walk.InitTraversal()
        while not walk.IsDoneWithTraversal():
            yield from _leaves(walk.GetCurrentDataObject())
            walk.GoToNextItem()


def _by_kind(
    types: IntArray, offsets: IntArray, corners: IntArray, degrees: IntArray | None
) -> Iterator[tuple[ElementKind | str, IntArray, IntArray]]:
    """Yield kinds, or names of those that are not supported, the cells' rows (k,) and their nodes (k, nodes)."""
    sizes = np.diff(offsets)
    keys = np.column_stack([types, sizes, np.zeros((len(types), 3), dtype=np.int64)])
    curved = np.isin(types, (*TETRAHEDRA, *HEXAHEDRA))
    if degrees is not None:
        keys[curved, 2:] = degrees[curved]
    for key in np.unique(keys, axis=0).tolist():
        rows = np.flatnonzero((keys == key).all(axis=1))
        kind = _kind(key[0], key[1], tuple(key[2:]))
        if kind is None:
            continue
        if isinstance(kind, str):
            yield kind, rows, np.empty((len(rows), 0), dtype=np.int64)
            continue
        nodes = corners[offsets[rows][:, None] + np.arange(key[1])]
        yield kind, rows, nodes[:, VOXEL] if key[0] == 11 else nodes


def _kind(cell: int, size: int, degrees: tuple[int, ...]) -> ElementKind | str | None:
    """Return the kind of VTK's cells of a type, the name of solid ones that are not supported, None for others."""
    if cell in FIXED:
        return FIXED[cell] if size == len(FIXED[cell].lattice) else f"cell of type {cell} with {size} nodes"
    if cell in TETRAHEDRA or cell in HEXAHEDRA:
        p, q, r = degrees if any(degrees) else _degrees_of(cell, size)
        is_bezier = cell in BEZIER
        try:
            kind = tetra(p, is_bezier) if cell in TETRAHEDRA else hexahedron(p, q, r, is_bezier=is_bezier)
        except ValueError:
            return f"{'tetra' if cell in TETRAHEDRA else 'hexahedron'}{size}"
        return kind if len(kind.lattice) == size else f"{kind} with {size} nodes"
    return OTHERS.get(cell)


def _degrees_of(cell: int, size: int) -> tuple[int, ...]:
    """Return the degree that cells of so many nodes have in each direction; 0 where there is none."""
    shape = "tetra" if cell in TETRAHEDRA else "hexahedron"
    return next(((p, p, p) for p in range(1, 12) if node_count(shape, p) == size), (0, 0, 0))
