"""Writes the boundary of a body as STEP or IGES: its spline faces, sewn to closed solids, without the inside.

A solid of the file is a connected part of the body; the shells of its cavities belong to it. STEP (ISO 10303-214) and
IGES 5.3 hold B-spline faces as they are, but have no trivariate splines. OpenCASCADE writes and sews; it takes lengths
for millimetres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.interface import axis_side, face_layer, outward

from ..errors import InputError
from .mfem_writer import right_handed

TOLERANCE = 1e-7  # of the body's size, up to which edges of two faces are sewn to one
SMALLEST = 1e-9  # of the body's size, below which a face is none: it has shrunk to an edge


def write_step(path: Path, given: BodyLike) -> None:
    """Write the solids of a body as STEP. Raises InputError where their faces do not close, OSError for the file."""
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    writer = STEPControl_Writer()
    with _silent():
        for solid in solids_of(as_body(given)):
            writer.Transfer(solid, STEPControl_AsIs)
        done = writer.Write(str(path)) == IFSelect_RetDone
    if not done:
        raise OSError(None, "OpenCASCADE could not write it")


def write_iges(path: Path, given: BodyLike) -> None:
    """Write the solids of a body as IGES. Raises InputError where their faces do not close, OSError for the file."""
    from OCP.IGESControl import IGESControl_Writer

    writer = IGESControl_Writer("MM", 1)
    with _silent():
        for solid in solids_of(as_body(given)):
            writer.AddShape(solid)
        writer.ComputeModel()
        done = writer.Write(str(path))
    if not done:
        raise OSError(None, "OpenCASCADE could not write it")


@contextmanager
def _silent() -> Iterator[None]:
    """Keep OpenCASCADE's statistics out of the output of the block."""
    from OCP.Message import Message, Message_Gravity

    printers = list(Message.DefaultMessenger_s().Printers())
    levels = [printer.GetTraceLevel() for printer in printers]
    for printer in printers:
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    try:
        yield
    finally:
        for printer, level in zip(printers, levels, strict=True):
            printer.SetTraceLevel(level)


def solids_of(body: Body) -> list[Any]:
    """Return a solid of OpenCASCADE (TopoDS_Solid) for each connected part of a body.

    Raises InputError where the faces of a part do not close.
    """
    upright = right_handed(body)
    return [_solid(upright, part) for part in body.parts]


def _solid(body: Body, part: Sequence[int]) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing

    sewing = BRepBuilderAPI_Sewing(TOLERANCE * body.size)
    for face in _faces(body, part):
        sewing.Add(face)
    sewing.Perform()
    if sewing.NbFreeEdges() or sewing.NbMultipleEdges():
        raise InputError(
            f"the spline faces do not close: {sewing.NbFreeEdges()} edges have one face, "
            f"{sewing.NbMultipleEdges()} have more than two; export it --to vtk"
        )
    make = BRepBuilderAPI_MakeSolid()
    for shell in _shells(sewing.SewedShape()):
        make.Add(shell)
    return make.Solid()


def _shells(sewn: Any) -> Iterator[Any]:
    """Yield the shells of a sewn shape, that with the largest volume first and outward, those of cavities inward."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_SHELL
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    found = []
    explorer = TopExp_Explorer(sewn, TopAbs_SHELL)
    while explorer.More():
        shell, properties = TopoDS.Shell(explorer.Current()), GProp_GProps()
        BRepGProp.VolumeProperties_s(shell, properties)
        found.append((properties.Mass(), shell))
        explorer.Next()
    found.sort(key=lambda pair: -abs(pair[0]))
    for place, (volume, shell) in enumerate(found):
        is_inward = volume < 0.0
        yield TopoDS.Shell(shell.Reversed()) if is_inward == (place == 0) else shell


def _faces(body: Body, part: Sequence[int]) -> Iterator[Any]:
    """Yield the outer faces (TopoDS_Face) of patches, which look outward."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    for number in part:
        patch = body.patches[number]
        weights = np.ones(patch.shape) if patch.weights is None else patch.weights
        for name in body.outer[number]:
            axis, side = axis_side(name)
            rows = [(patch.knots[a], patch.degrees[a]) for a in range(3) if a != axis]
            net = outward(face_layer(patch.control_points, name), name)
            own = outward(face_layer(weights, name), name)
            if bool(side) == (axis == 1):  # as `outward` has exchanged the directions
                rows.reverse()
            surface = _surface(net, own, rows)
            yield BRepBuilderAPI_MakeFace(surface, SMALLEST * body.size).Face()


def _surface(net: Array, weights: Array, rows: Sequence[tuple[Array, int]]) -> Any:
    """Return the surface (Geom_BSplineSurface) of control points (a, b, 3), weights (a, b), knots and degrees."""
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt
    from OCP.TColgp import TColgp_Array2OfPnt
    from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal, TColStd_Array2OfReal

    poles = TColgp_Array2OfPnt(1, net.shape[0], 1, net.shape[1])
    factors = TColStd_Array2OfReal(1, net.shape[0], 1, net.shape[1])
    for i, row in enumerate(net.tolist(), 1):
        for j, (x, y, z) in enumerate(row, 1):
            poles.SetValue(i, j, gp_Pnt(x, y, z))
            factors.SetValue(i, j, float(weights[i - 1, j - 1]))
    knots, counts = [], []
    for row, _ in rows:
        values, times = np.unique(row, return_counts=True)
        own, multiplicities = TColStd_Array1OfReal(1, len(values)), TColStd_Array1OfInteger(1, len(values))
        for place, (value, count) in enumerate(zip(values.tolist(), times.tolist(), strict=True), 1):
            own.SetValue(place, value)
            multiplicities.SetValue(place, count)
        knots.append(own)
        counts.append(multiplicities)
    (_, p), (_, q) = rows
    return Geom_BSplineSurface(poles, factors, knots[0], knots[1], counts[0], counts[1], p, q, False, False)
