"""Writes volume meshes in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista
from known_meshes import HEX8, HEX20, HEX27, HEX64, TET4, TET10, TET20
from scipy.io import netcdf_file

from iga_nn.io.abaqus_mesh import C3D27
from iga_nn.io.exodus_mesh import ORDERS
from iga_nn.io.gmsh_mesh import order_of

GMSH = {HEX8: 5, HEX20: 17, HEX27: 12, HEX64: 92, TET4: 4, TET10: 11, TET20: 29}
VTK = {HEX8: 12, HEX20: 25, HEX27: 29, HEX64: 72, TET4: 10, TET10: 24, TET20: 71}
ABAQUS = {HEX8: "C3D8R", HEX20: "C3D20", HEX27: "C3D27", TET4: "C3D4", TET10: "DC3D10"}


def write_msh(path: Path, mesh, version="2.2"):
    """Write text of Gmsh, version 2.2, or 4.1 with every element in volume 1, physical group 5 "steel"."""
    (block,) = mesh.blocks
    nodes = np.empty_like(block.nodes)
    nodes[:, order_of(block.kind)] = block.nodes
    kind, n, m = GMSH[block.kind], len(mesh.points), len(nodes)
    rows = [f"$MeshFormat\n{version} 0 8\n$EndMeshFormat", '$PhysicalNames\n1\n3 5 "steel"\n$EndPhysicalNames']
    places = [" ".join(map(repr, point)) for point in mesh.points.tolist()]
    cells = [" ".join(str(10 + x) for x in row) for row in nodes.tolist()]
    if version == "2.2":
        rows += ["$Nodes", str(n), *(f"{10 + k} {place}" for k, place in enumerate(places)), "$EndNodes", "$Elements"]
        rows += [str(m + 1), "1 15 2 0 1 10", *(f"{100 + k} {kind} 2 5 1 {cell}" for k, cell in enumerate(cells))]
    else:
        rows += ["$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 5 0\n$EndEntities", f"$Nodes\n1 {n} 10 {9 + n}\n3 1 0 {n}"]
        rows += [*(str(10 + k) for k in range(n)), *places, "$EndNodes", f"$Elements\n1 {m} 100 {99 + m}"]
        rows += [f"3 1 {kind} {m}", *(f"{100 + k} {cell}" for k, cell in enumerate(cells))]
    path.write_text("\n".join([*rows, "$EndElements", ""]))


def write_inp(path: Path, mesh):
    (block,) = mesh.blocks
    nodes = block.nodes if block.kind != HEX27 else block.nodes[:, np.argsort(C3D27)]
    rows = ["*HEADING", "a part", "** a comment", "*NODE, NSET=all"]
    rows += [f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist())]
    rows += [f"*ELEMENT, TYPE={ABAQUS[block.kind]},", " ELSET=steel"]
    for k, row in enumerate((nodes + 1).tolist()):
        words = [str(100 + k), *map(str, row)]
        lines = [words[at : at + 16] for at in range(0, len(words), 16)]
        rows += [", ".join(line) + ("," if line is not lines[-1] else "") for line in lines]
    path.write_text("\n".join([*rows, "*ELSET, ELSET=some, GENERATE", "100, 102, 1", "*STEP", "*END STEP", ""]))


def as_vtk(mesh, cell=None):
    (block,) = mesh.blocks
    cells = np.insert(block.nodes, 0, block.nodes.shape[1], axis=1).ravel()
    return pyvista.UnstructuredGrid(cells, np.full(len(block.nodes), cell or VTK[block.kind]), mesh.points)


def write_exodus(path: Path, mesh):
    (block,) = mesh.blocks
    nodes = np.empty_like(block.nodes)
    nodes[:, ORDERS.get(f"hexahedron{nodes.shape[1]}", slice(None))] = block.nodes
    name = {HEX8: "HEX8", HEX20: "HEX20", HEX27: "HEX27", TET4: "TETRA4", TET10: "TETRA10"}[block.kind]
    with netcdf_file(path, "w") as file:
        file.api_version = file.version = np.float32(5.0)
        file.floating_point_word_size = np.int32(8)
        file.file_size = np.int32(1)
        file.title = b"a part"
        sizes = {"len_string": 33, "len_line": 81, "four": 4, "num_dim": 3, "num_nodes": len(mesh.points)}
        sizes |= {
            "num_elem": len(nodes),
            "num_el_blk": 1,
            "num_el_in_blk1": len(nodes),
            "num_nod_per_el1": nodes.shape[1],
        }
        file.createDimension("time_step", None)
        for dimension, size in sizes.items():
            file.createDimension(dimension, size)
        file.createVariable("time_whole", "d", ("time_step",))
        file.createVariable("eb_status", "i", ("num_el_blk",))[:] = 1
        numbers = file.createVariable("eb_prop1", "i", ("num_el_blk",))
        numbers[:] = 1
        numbers.name = b"ID"
        for axis, coordinate in enumerate(["coordx", "coordy", "coordz"]):
            file.createVariable(coordinate, "d", ("num_nodes",))[:] = mesh.points[:, axis]
        connect = file.createVariable("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"))
        connect[:] = nodes + 1
        connect.elem_type = name.encode()
