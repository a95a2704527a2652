"""A program of its own: a STEP or IGES file to the arrays of its triangles, by OpenCASCADE.

`cad.py` runs it with the file, the .npz to write, the kind, the deflection in millimetres, 0 for a share of the box's
diagonal, that share, and the angle between triangles in radians. It imports OCP and numpy alone.
"""

import sys
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

SEWN = 1e-5  # of the box's diagonal: gaps between the faces of a model without solids that are sewn


def shape_of(path: str, kind: str) -> Any:
    """Return the shape in a file, None where it cannot be read; lengths are millimetres."""
    reader = STEPControl_Reader() if kind == "step" else IGESControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone or not reader.TransferRoots():
        return None
    return reader.OneShape()


def diagonal(shape: Any) -> float:
    """Return the diagonal of a shape's box."""
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    return float(box.SquareExtent() ** 0.5)


def sewn(shape: Any) -> Any:
    """Return a shape whose faces have common edges: itself where it has solids, otherwise its faces, sewn."""
    if TopExp_Explorer(shape, TopAbs_SOLID).More():
        return shape
    sewing = BRepBuilderAPI_Sewing(SEWN * diagonal(shape))
    sewing.Add(shape)
    sewing.Perform()
    return sewing.SewedShape()


def triangles(shape: Any) -> tuple[Any, Any, Any]:
    """Return vertices (n, 3), triangles (m, 3) and the number of each triangle's face, from 1, (m,)."""
    points: list[tuple[float, float, float]] = []
    corners: list[tuple[int, ...]] = []
    labels: list[int] = []
    explorer, number = TopExp_Explorer(shape, TopAbs_FACE), 0
    while explorer.More():
        face, place, number = TopoDS.Face(explorer.Current()), TopLoc_Location(), number + 1
        explorer.Next()
        found = BRep_Tool.Triangulation_s(face, place)
        if found is None:
            continue
        first, where = len(points) - 1, place.Transformation()
        for k in range(1, found.NbNodes() + 1):
            node = found.Node(k).Transformed(where)
            points.append((node.X(), node.Y(), node.Z()))
        for k in range(1, found.NbTriangles() + 1):
            row = tuple(first + corner for corner in found.Triangle(k).Get())
            corners.append(row[::-1] if face.Orientation() == TopAbs_REVERSED else row)
            labels.append(number)
    return np.array(points).reshape(-1, 3), np.array(corners).reshape(-1, 3), np.array(labels)


def main(source: str, target: str, kind: str, deflection: str, share: str, angle: str) -> None:
    """Write the arrays vertices, faces and labels; nothing where the file cannot be read."""
    shape = shape_of(source, kind)
    if shape is None or shape.IsNull():
        return
    shape = sewn(shape)
    BRepMesh_IncrementalMesh(shape, float(deflection) or float(share) * diagonal(shape), False, float(angle), False)
    vertices, faces, labels = triangles(shape)
    np.savez(target, vertices=vertices, faces=faces, labels=labels)


if __name__ == "__main__":
    main(*sys.argv[1:])
