"""Certify meshes of many elements: CPU seconds of reading a file, of det J, and of overlap, by kind.

Grids through a smooth map, with nodes moved at random; `--elements` of each kind, written as .msh and read again.

    python examples/benchmarks/mesh_certificates.py --elements 100000
"""

from __future__ import annotations

import argparse
import tempfile
import time
from itertools import permutations
from pathlib import Path

import numpy as np
from processes import as_markdown

import iga_nn
from iga_nn.io.gmsh_mesh import order_of
from parameterize.meshes.certify import MeshCertificate
from parameterize.meshes.kinds import ElementKind, kind_named
from parameterize.meshes.overlap import check_overlap

KINDS = {"hexahedron": 5, "hexahedron20": 17, "hexahedron27": 12, "tetra": 4, "tetra10": 11, "tetra20": 29}  # of Gmsh
MOVED = 0.02  # of an element's edge, at random
HEAD = ("elements", "number", "nodes", "read", "det J", "overlap", "verdict", "one-to-one", "least det J / mean")


def grid(kind: ElementKind, count: int) -> iga_nn.VolumeMesh:
    """Return about so many elements: a twisted cube of cubes, each cut into six for tetrahedra."""
    per_cube = 1 if kind.shape == "hexahedron" else 6
    n = max(1, round((count / per_cube) ** (1 / 3)))
    p = kind.degrees[0]
    places = np.stack(np.meshgrid(*[np.arange(p * n + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    local = [kind.lattice] if per_cube == 1 else [_tetra(kind, way) for way in permutations(range(3))]
    nodes = np.concatenate([np.ravel_multi_index((cells[:, None] * p + own).T, (p * n + 1,) * 3).T for own in local])
    u, v, w = (places / (p * n)).T
    points = np.stack([u + 0.2 * v * w, v + 0.2 * np.sin(2.0 * w), w + 0.1 * u * v], axis=1)
    points += MOVED / (n * p) * np.random.default_rng(0).normal(size=points.shape)
    used, compact = np.unique(nodes, return_inverse=True)
    name = {str(kind_named(name)): name for name in KINDS}[str(kind)]
    return iga_nn.VolumeMesh.of(points[used], {name: compact.reshape(nodes.shape)})


def _tetra(kind: ElementKind, way: tuple[int, ...]) -> np.ndarray:
    """Return the places of the nodes of one of the six tetrahedra of a cube, along a way from corner to corner."""
    corners = np.cumsum([np.zeros(3, dtype=int), *np.eye(3, dtype=int)[list(way)]], axis=0)
    if np.linalg.det(corners[1:]) < 0.0:
        corners[[1, 2]] = corners[[2, 1]]
    return np.column_stack([kind.degrees[0] - kind.lattice.sum(axis=1), kind.lattice]) @ corners


def write(path: Path, mesh: iga_nn.VolumeMesh) -> None:
    """Write a mesh as binary .msh of version 2.2."""
    (block,) = mesh.blocks
    nodes = np.empty_like(block.nodes)
    nodes[:, order_of(block.kind)] = block.nodes + 1
    number = {str(kind_named(name)): code for name, code in KINDS.items()}[str(block.kind)]
    places = np.empty(len(mesh.points), dtype=[("number", "<i4"), ("place", "<f8", 3)])
    places["number"], places["place"] = 1 + np.arange(len(places)), mesh.points
    rows = np.column_stack([block.numbers, np.ones((len(nodes), 2)), nodes]).astype("<i4")
    head = np.array([number, len(nodes), 2], dtype="<i4")
    parts = [b"$MeshFormat\n2.2 1 8\n", np.array([1], dtype="<i4").tobytes(), b"\n$EndMeshFormat\n$Nodes\n"]
    parts += [f"{len(places)}\n".encode(), places.tobytes(), b"\n$EndNodes\n$Elements\n", f"{len(nodes)}\n".encode()]
    path.write_bytes(b"".join([*parts, head.tobytes(), rows.tobytes(), b"\n$EndElements\n"]))


def measured(name: str, count: int, folder: Path) -> tuple[str, ...]:
    """Return a row of the table: CPU seconds of this process."""
    path = folder / f"{name}.msh"
    write(path, grid(kind_named(name), count))
    start = time.process_time()
    mesh = iga_nn.load_mesh(path)
    read = time.process_time()
    found: MeshCertificate = iga_nn.certify_mesh(mesh)
    certified = time.process_time()
    check_overlap(mesh, 1)
    overlap = time.process_time() - certified
    seconds = (read - start, certified - read - overlap, overlap)
    numbers = (f"{len(mesh)}", f"{len(mesh.points)}", *(f"{x:.1f}" for x in seconds))
    return (name, *numbers, found.verdict, found.one_to_one, f"{found.lower_bound:.2f}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, default=100_000, help="of each kind, about")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measured("tetra10", 48, Path(folder))  # kernels are compiled
        rows = [measured(name, given.elements, Path(folder)) for name in KINDS]
    print(as_markdown(HEAD, rows))


if __name__ == "__main__":
    main()
