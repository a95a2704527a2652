"""Tests iga_nn.io.boundary_faces: OpenCASCADE reads the solids back, with our area and volume."""

import pytest
from bodies import ring
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from test_io_calculix import bar, block

import iga_nn
from iga_nn.cli.commands import main
from parameterize.spline.body import Body, as_body
from solve import benchmark_volume

READERS = {"step": STEPControl_Reader, "iges": IGESControl_Reader}


def shell_of_boxes():
    """Return 26 boxes around one that is missing: a cavity."""
    ends = [0.0, 1.0, 2.0, 3.0]
    places = [(i, j, k) for i in range(3) for j in range(3) for k in range(3) if (i, j, k) != (1, 1, 1)]
    return Body.from_patches([block([ends[a] for a in p], [ends[a + 1] for a in p]) for p in places])


BODIES = {
    "wavy": lambda: benchmark_volume(4, amplitude=0.1),
    "ring": lambda: ring(3),
    "left": bar,
    "cavity": shell_of_boxes,
    "apart": lambda: Body.from_patches([block((0, 0, 0), (1, 1, 1)), block((3, 0, 0), (4, 2, 1))]),
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("name", BODIES)
def test_opencascade_reads_closed_solids_of_our_size(tmp_path, kind, name, capfd):
    body = as_body(BODIES[name]())
    body.save(tmp_path / "body.npz")
    path = tmp_path / f"out.{'igs' if kind == 'iges' else 'step'}"
    assert main(["export", str(tmp_path / "body.npz"), "--to", kind, "--out", str(path)]) == 0
    assert capfd.readouterr().out.strip() == str(path)
    reader = READERS[kind]()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    assert BRepCheck_Analyzer(shape).IsValid()
    solids, explorer = 0, TopExp_Explorer(shape, TopAbs_SOLID)
    while explorer.More():
        solids += 1
        explorer.Next()
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume, 1e-9)
    BRepGProp.SurfaceProperties_s(shape, area, 1e-9)
    assert solids == len(body.parts)
    assert volume.Mass() == pytest.approx(float(iga_nn.integrate(body)), rel=1e-6)
    faces = [body.face_name(*face) for face in body.outer_faces]
    assert area.Mass() == pytest.approx(float(iga_nn.integrate(body, over=faces)), rel=1e-5)
