"""Writers of PLY, MSH and VTU files in all their variants, which the libraries' writers do not make."""

import struct

import numpy as np
import pyvista
from mesh_files import CUBE, MIXED, TRIANGLES
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

TYPES = {"char": "b", "uchar": "B", "int8": "b", "uint8": "B", "short": "h", "ushort": "H", "int16": "h"}
TYPES |= {"uint16": "H", "int": "i", "uint": "I", "int32": "i", "uint32": "I", "float": "f", "float32": "f"}
TYPES |= {"double": "d", "float64": "d"}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


class Ply:
    """Writes a PLY property by property: elements are (name, properties, rows), a list given as a tuple in its row."""

    def __init__(self, *elements, comments=("made by code",), newline="\n"):
        self.elements, self.comments, self.newline = elements, comments, newline

    def header(self, form):
        lines = ["ply", f"format {form} 1.0", *(f"comment {text}" for text in self.comments)]
        for name, properties, rows in self.elements:
            lines += [f"element {name} {len(rows)}", *(f"property {text}" for text in properties)]
        return self.newline.join([*lines, "end_header", ""]).encode()

    def content(self, form):
        body = b""
        for _, properties, rows in self.elements:
            for row in rows:
                body += b"".join(self.packed(form, *pair) for pair in zip(properties, row, strict=True))
                body += self.newline.encode() * (form == "ascii")
        return self.header(form) + body

    def packed(self, form, text, value):
        words = text.split()
        values = [len(value), *value] if words[0] == "list" else [value]
        if form == "ascii":
            return (" ".join(map(str, values)) + " ").encode()
        kinds = [words[1], *[words[2]] * len(value)] if words[0] == "list" else words[:1]
        return struct.pack(ORDERS[form] + "".join(TYPES[kind] for kind in kinds), *values)


PLACES = ["float x", "float y", "float z"]
CORNERS = ["list uchar int vertex_indices"]


def vertices(places=PLACES):
    return "vertex", places, CUBE.tolist()


def faces(rows=MIXED, properties=CORNERS):
    return "face", properties, [(tuple(row),) for row in rows]


def beside(element, before=(), after=(), values_before=(), values_after=()):
    """The same element with other properties around its own."""
    name, properties, rows = element
    filled = [(*values_before, *row, *values_after) for row in rows]
    return name, [*before, *properties, *after], filled


def rows(table):
    return "".join(" ".join(map(str, row)) + "\n" for row in table)


NUMBERS = [17, 3, 900_000_000_001, 5, 8, 6, 7, 1]  # of the nodes: any


def section(name, content):
    return f"${name}\n{content}$End{name}\n"


def msh2(numbers=None, more="", elements=None):
    numbers = numbers or range(1, 9)
    elements = elements or [(i + 1, 2, 2, 1, 1, *(numbers[k] for k in face)) for i, face in enumerate(TRIANGLES)]
    nodes = f"8\n{rows((n, *p) for n, p in zip(numbers, CUBE, strict=True))}"
    return (
        section("MeshFormat", "2.2 0 8\n")
        + more
        + section("Nodes", nodes)
        + section("Elements", f"{len(elements)}\n{rows(elements)}")
    )


def msh41(numbers=NUMBERS, parametric=0, dimension=2, version="4.1"):
    extra = [0.5] * dimension * parametric
    faces_of = [(i + 1, *(numbers[k] for k in face)) for i, face in enumerate(TRIANGLES)]
    if version == "4.1":
        nodes = f"2 8 1 9\n0 1 0 1\n{numbers[0]}\n0 0 0\n{dimension} 1 {parametric} 7\n"
        nodes += rows([[n] for n in numbers[1:]]) + rows((*p, *extra) for p in CUBE[1:])
        elements = f"1 12 1 12\n2 1 2 12\n{rows(faces_of)}"
    else:
        nodes = f"2 8\n1 0 0 1\n{numbers[0]} 0 0 0\n1 {dimension} {parametric} 7\n"
        nodes += rows((n, *p, *extra) for n, p in zip(numbers[1:], CUBE[1:], strict=True))
        elements = f"1 12\n1 2 2 12\n{rows(faces_of)}"
    form = section("MeshFormat", f"{version} 0 8\n")
    return form + section("Nodes", nodes) + section("Elements", elements)


def msh41_binary(order, parametric):
    def packed(form, *values):
        return struct.pack(order + form, *values)

    nodes = packed("4q", 1, 8, 1, 8) + packed("3iq", 2, 1, parametric, 8) + packed("8q", *NUMBERS)
    nodes += b"".join(packed("3d", *p) + packed("2d", 0.5, 0.5) * parametric for p in CUBE)
    elements = packed("4q", 1, 12, 1, 12) + packed("3iq", 2, 1, 2, 12)
    elements += b"".join(packed("4q", i, *(NUMBERS[k] for k in face)) for i, face in enumerate(TRIANGLES))
    entities = packed("4q", 1, 0, 1, 0) + packed("i3dq", 1, 0, 0, 0, 0)
    entities += packed("i6dq2iq", 1, *[0.0] * 6, 2, 5, 8, 0)  # in two physical groups
    form = b"$MeshFormat\n4.1 1 8\n" + packed("i", 1) + b"\n$EndMeshFormat\n"
    sections = {b"Entities": entities, b"Nodes": nodes, b"Elements": elements}
    return form + b"".join(b"$%b\n%b\n$End%b\n" % (name, body, name) for name, body in sections.items())


def msh2_binary(order, several):
    def packed(form, *values):
        return struct.pack(order + form, *values)

    nodes = b"8\n" + b"".join(packed("i3d", i + 1, *p) for i, p in enumerate(CUBE))
    blocks = [TRIANGLES[:4], TRIANGLES[4:]] if several else [TRIANGLES]
    elements = b"14\n" + packed("3i", 15, 2, 2) + packed("8i", 1, 0, 0, 1, 2, 0, 0, 2)
    for block in blocks:
        elements += packed("3i", 2, len(block), 3)
        elements += b"".join(packed("7i", 5, 1, 1, 0, *(face + 1)) for face in block)
    form = b"$MeshFormat\n2.2 1 8\n" + packed("i", 1) + b"\n$EndMeshFormat\n"
    return form + b"$Nodes\n%b\n$EndNodes\n$Elements\n%b\n$EndElements\n" % (nodes, elements)


def grid(cells, points=CUBE):
    """A grid of cells [(type, corners)]."""
    rows = np.concatenate([[len(corners), *corners] for _, corners in cells])
    return pyvista.UnstructuredGrid(rows, [kind for kind, _ in cells], np.array(points, dtype=float))


def save(mesh, path, mode="appended", compressor=None, header=32, order="little", block=1 << 15, encoded=False):
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary}.get(mode, writer.SetDataModeToAppended)()
    writer.SetEncodeAppendedData(encoded)
    getattr(writer, f"SetCompressorTypeTo{compressor or 'None'}")()
    {32: writer.SetHeaderTypeToUInt32, 64: writer.SetHeaderTypeToUInt64}[header]()
    {"little": writer.SetByteOrderToLittleEndian, "big": writer.SetByteOrderToBigEndian}[order]()
    writer.SetBlockSize(block)
    assert writer.Write()
    return path
