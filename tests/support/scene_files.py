"""Files of scenes made by code: glTF, 3MF, archives, VTK's polygons, and solid models where OpenCASCADE is there."""

import io
import json
import zipfile
from base64 import b64encode

import numpy as np
from mesh_files import CUBE, TRIANGLES
from threemf_files import package


def gltf(vertices=CUBE, faces=TRIANGLES, nodes=None, primitive=None, inside=True, beside="", **more):
    """The description (JSON) and the binary chunk of a mesh; inside: whether that chunk is the buffer.

    beside: the name of the file that is the buffer.
    """
    binary = np.asarray(vertices, "<f4").tobytes() + np.asarray(faces, "<u2").tobytes()
    places = 12 * len(vertices)
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0, "name": "cube"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, **(primitive or {})}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": np.size(faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": places},
            {"buffer": 0, "byteOffset": places, "byteLength": len(binary) - places},
        ],
        "buffers": [{"byteLength": len(binary)}],
        **more,
    }
    if not inside:
        document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + b64encode(binary).decode()
    if beside:
        document["buffers"][0]["uri"] = beside
    return json.dumps(document).encode(), binary


def glb(pieces):
    """A .glb of its two chunks."""
    text, binary = (piece + fill * (-len(piece) % 4) for piece, fill in zip(pieces, (b" ", b"\0"), strict=True))
    chunks = [len(text).to_bytes(4, "little") + b"JSON" + text, len(binary).to_bytes(4, "little") + b"BIN\0" + binary]
    body = b"".join(chunks)
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def model(vertices=CUBE, faces=TRIANGLES, unit="inch", build='<item objectid="2"/>', more=""):
    """The model of a 3MF: a cube as object 1, twice as large and moved by (5, 0, 0) as object 2."""
    corners = "".join('<vertex x="{:g}" y="{:g}" z="{:g}"/>'.format(*vertex) for vertex in vertices)
    rows = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in faces)
    mesh = f"<mesh><vertices>{corners}</vertices><triangles>{rows}</triangles></mesh>"
    inner = '<component objectid="1" transform="2 0 0 0 2 0 0 0 2 5 0 0"/>'
    objects = f'<object id="1" name="block">{mesh}</object><object id="2"><components>{inner}</components></object>'
    space = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    text = f'<model unit="{unit}" xmlns="{space}"><resources>{objects}{more}</resources><build>{build}</build></model>'
    return ('<?xml version="1.0"?>' + text).encode()


def zipped(members):
    """An archive of members by their names."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED, compresslevel=1)
    return stream.getvalue()


def threemf(content=None):
    return package(model() if content is None else content)


def solid_model(kind="step", unit="MM"):
    """The bytes of an L-bracket with a round end, or None where OpenCASCADE is missing. Lengths are of that unit."""
    try:
        from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
        from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
        from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
        from OCP.IGESControl import IGESControl_Writer
        from OCP.Interface import Interface_Static
        from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    except ImportError:
        return None
    import tempfile
    from pathlib import Path

    scale = {"MM": 1.0, "INCH": 25.4, "M": 1000.0}[unit]  # shapes are in millimetres
    foot = BRepPrimAPI_MakeBox(6.0 * scale, 4.0 * scale, 1.0 * scale).Shape()
    wall = BRepPrimAPI_MakeBox(1.0 * scale, 4.0 * scale, 5.0 * scale).Shape()
    end = gp_Ax2(gp_Pnt(6.0 * scale, 2.0 * scale, 0.0), gp_Dir(0.0, 0.0, 1.0))
    round_end = BRepPrimAPI_MakeCylinder(end, 2.0 * scale, 1.0 * scale).Shape()
    shape = BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(foot, wall).Shape(), round_end).Shape()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "part")
        if kind == "step":
            writer = STEPControl_Writer()
            Interface_Static.SetCVal_s("write.step.unit", unit)
            writer.Transfer(shape, STEPControl_AsIs)
            writer.Write(str(path))
        else:
            writer = IGESControl_Writer(unit, 0)
            writer.AddShape(shape)
            writer.ComputeModel()
            writer.Write(str(path))
        return path.read_bytes()
