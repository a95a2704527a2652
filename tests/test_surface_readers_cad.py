"""STEP and IGES by OpenCASCADE; without it one line says what to install.

data/bracket.step, made with OpenCASCADE 7.8: an L of a foot 60 x 40 x 10 and a wall 10 x 40 x 50, in millimetres, with
a hole of radius 8 through the foot.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from math import pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from iges_files import with_unit
from scene_files import solid_model
from step_files import (
    BOX,
    FRAME,
    SIDES,
    Step,
    converted,
    crowded,
    listed,
    metric,
    placed,
    solid_and,
    solid_beside,
    with_a_mesh,
)

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.report import document as report
from iga_nn.workflow.regions import check_regions, facts_of
from parameterize.surface.brep import kept_brep
from parameterize.surface.geometry import normals_and_areas
from parameterize.surface.readers import cad
from parameterize.surface.readers.common import SurfaceFile
from parameterize.surface.readers.file import read_mesh
from parameterize.surface.solid import Solid
from parameterize.surface.surface import MeshError, bodies_in, load_surface
from solve.forms.region import Region

VOLUME = 6 * 4 * 1 + 1 * 4 * 4 + 0.5 * pi * 2**2  # foot, wall, half a disc at the end
BRACKET = Path(__file__).parent / "data" / "bracket.step"
BACK, FRONT, HOLE = "group:face1", "group:face8", "group:face9"
NAMES = {"MM": "mm", "INCH": "in", "M": "m"}


@pytest.fixture
def part(monkeypatch):
    """The bytes of a bracket by kind and unit; OpenCASCADE, which takes seconds to load, runs in this process."""
    pytest.importorskip("OCP")
    program = import_module("parameterize.surface.readers.opencascade")

    def run(command, **options):
        program.main(*command[2:])
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(Solid, "deepest", lambda solid: (np.full(3, 0.5), 0.0))  # takes a second, and is not looked at
    monkeypatch.setattr(cad, "subprocess", SimpleNamespace(**vars(subprocess) | {"run": run}))
    return solid_model


def by_face(surface):
    """Return the groups of single faces, face1, face2, ..., without those of names."""
    return {name: rows for name, rows in surface.groups.items() if name.startswith("face")}


@pytest.mark.parametrize(("kind", "unit"), [("step", "MM"), ("step", "INCH"), ("step", "M"), ("iges", "INCH")])
def test_a_bracket_keeps_its_unit_and_its_faces(kind, unit, part, tmp_path):
    path = tmp_path / f"bracket.{kind}"
    path.write_bytes(part(kind, unit))
    surface = load_surface(path)
    assert surface.unit == NAMES[unit] and surface.volume == pytest.approx(VOLUME, rel=1e-3)
    assert np.allclose(surface.bbox, [[0, 0, 0], [8, 4, 5]], atol=1e-9)
    areas = [surface.part.area(faces) for faces in by_face(surface).values()]
    assert sum(areas) == pytest.approx(surface.part.area(np.arange(len(surface.faces))))
    assert min(abs(np.array(areas) - 1 * 4)) < 1e-9  # the top of the wall


def test_a_bracket_with_a_hole_has_a_handle_and_its_faces_by_name():
    pytest.importorskip("OCP")
    surface = load_surface(BRACKET)
    assert surface.genus == 1 and surface.unit == "mm" and len(by_face(surface)) == 9
    assert surface.volume == pytest.approx(60 * 40 * 10 + 10 * 40 * 40 - 10 * pi * 8**2, rel=1e-3)
    areas = [surface.part.area(surface.groups[name.removeprefix("group:")]) for name in (BACK, FRONT, HOLE)]
    assert areas == pytest.approx([40 * 50, 40 * 10, 2 * pi * 8 * 10], rel=2e-3)
    check_regions(iga_nn.Elasticity(fix=BACK, load={FRONT: (0, 0, -1)}).on_surface(surface.part), surface)


def test_faces_of_a_solid_are_named_by_their_shapes():
    """A region may say the bore by its number or its radius, and a plane by where it cuts an axis."""
    pytest.importorskip("OCP")
    surface = load_surface(BRACKET)
    hole = 2 * pi * 8 * 10
    regions = {"bore 1": hole, "radius 8": hole, "radius 8.0": hole, "plane z = 50": 40 * 10, "plane x=0": 40 * 50}
    for text, area in regions.items():
        found = facts_of(Region(text).placed(surface=surface.part), surface)
        assert found["area"] == pytest.approx(area, rel=2e-3), text
    assert surface.shapes["bore 1"].startswith("cylinder of radius 8, axis (0, 0, 1) through ")
    shown = next(row for row in surface.summary()["groups"] if row["name"] == "bore 1")
    assert shown["shape"] == surface.shapes["bore 1"]
    with pytest.raises(ValueError, match="group 'bore 2' does not exist; the mesh has these groups: .*bore 1"):
        facts_of(Region("bore 2").placed(surface=surface.part), surface)


@pytest.mark.slow
def test_a_bracket_with_a_hole_is_held_and_loaded_at_faces_by_name(in_folder):
    """The wall holds what pulls at the front, 40 x 10 with one unit of force each."""
    pytest.importorskip("OCP")
    options = ["--young", "200", "--fix", BACK, "--load", f"{FRONT}=0;0;-1", "--control-points", "8", "--refine", "0"]
    assert main(["run", "elasticity", str(BRACKET), *options, "--out", "out"]) == 0
    found = report.read(in_folder / "out")
    assert found["parameterization"]["bijective"] == "certified"
    areas = {row["region"]: row["area"] for row in found["elasticity"]["regions"]}
    assert areas[BACK] == pytest.approx(40 * 50, rel=0.05) and areas[FRONT] == pytest.approx(40 * 10, rel=0.05)
    reaction = found["elasticity"]["levels"][0]["reactions"][f"fix {BACK!r}"]
    assert reaction[2] == pytest.approx(areas[FRONT], rel=1e-6)


MEASURED = """
import json, sys
from netgen.occ import OCCGeometry
print(json.dumps([(face.mass, *face.center) for face in OCCGeometry(sys.argv[1]).shape.faces]))
"""


@pytest.mark.parametrize("unit", ["MM", "INCH"])
def test_netgen_finds_the_exact_faces_in_the_order_of_their_numbers(unit, part, tmp_path):
    pytest.importorskip("netgen")
    surface = read(tmp_path, part("step", unit), deflection=1e-3)
    (tmp_path / "part.brep").write_bytes(surface.brep)
    rows = json.loads(subprocess.check_output([sys.executable, "-c", MEASURED, tmp_path / "part.brep"]))
    assert len(rows) == len(by_face(surface))
    for number, (area, *middle) in enumerate(rows, start=1):
        own = np.flatnonzero(surface.brep_faces == number)
        assert np.array_equal(own, surface.groups[f"face{number}"])
        areas = normals_and_areas(surface.vertices, surface.faces[own])[1]
        centre = np.average(surface.vertices[surface.faces[own]].mean(axis=1), axis=0, weights=areas)
        assert areas.sum() == pytest.approx(area, rel=1e-3) and centre == pytest.approx(middle, abs=1e-3)


def test_the_exact_faces_are_those_of_the_chosen_solid_and_of_a_shape_that_repairs_leave(part, tmp_path):
    lid = read(tmp_path, of(box(), box((1, 1, 1), (9, 0, 0))), component=1)
    assert lid.brep.count(b"\nSo\n") == 1 and list(by_face(lid)) == [f"face{k}" for k in range(7, 13)]
    assert np.unique(lid.brep_faces).tolist() == [1, 2, 3, 4, 5, 6]
    raw = read_mesh(tmp_path / "part.step", 1000)
    assert kept_brep(raw, np.arange(24)).text == raw.brep.text
    for old in (np.arange(23), np.array([*range(12), -1])):
        assert kept_brep(raw, old).text == b""


def test_deflection_is_the_distance_from_curved_faces(part, tmp_path):
    path = tmp_path / "bracket.step"
    path.write_bytes(part())
    gaps = []
    for deflection in (0.02, 0.0001):  # the first is met by the angle between triangles already
        surface = load_surface(path, deflection=deflection)
        corners = surface.vertices[surface.faces]
        radii = np.linalg.norm(corners[..., :2] - [6.0, 2.0], axis=2)
        end = corners[np.all(abs(radii - 2.0) < 1e-9, axis=1) & np.all(corners[..., 0] > 5.99, axis=1)]
        end = end[np.ptp(end[..., 2], axis=1) > 0.5]  # not those of the plane faces
        middles = 0.5 * (end + np.roll(end, 1, axis=1))  # of edges
        gaps.append(2.0 - np.linalg.norm(middles[..., :2] - [6.0, 2.0], axis=2).min())
        assert 0.0 < gaps[-1] < deflection
    assert gaps[1] < 0.5 * gaps[0]
    with pytest.raises(MeshError, match="deflection must be a positive length, got -1"):
        load_surface(path, deflection=-1.0)


def read(tmp_path, data, name="part.step", **options):
    path = tmp_path / name
    path.write_bytes(data)
    return load_surface(path, **options)


def of(*items, **options):
    """A file of these items, each made by a function of the file."""
    step = Step()
    step.part(*(make(step) for make in items), **options)
    return step.data()


def box(size=(1, 2, 3), low=(0, 0, 0), name=""):
    return lambda step: step.box(size, low, name)


def plane(step):
    return step.add(f"PLANE('',{step.placement()})")


def hidden_face(step):
    item = step.surfaces(step.loose())
    step.add(f"INVISIBILITY(({step.styled(item)}))")
    return item


def curves(step):
    return step.set_of(step.segment((5, 5, 5), (6, 6, 6)), kind="GEOMETRIC_CURVE_SET")


def csg(step):
    block = step.add(f"BLOCK('',{step.placement()},1.,1.,1.)")
    return step.add(f"CSG_SOLID('',{block})")


def noted():
    step = Step()
    step.part(step.box())
    step.note()
    return step.data()


WIRES = "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION"
CONSTRUCTION = ("CONSTRUCTIVE_GEOMETRY_REPRESENTATION", "CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP")
BESIDE = {
    "note": (noted(), "1 annotation"),
    "datum plane": (solid_beside(plane, *CONSTRUCTION), "1 surface without an outline"),
    "loose face": (solid_and(lambda step: step.surfaces(step.loose(), step.loose((0, 0, 7)))), "2 loose faces"),
    "shell": (solid_and(Step.loose), "1 loose shell"),
    "surfaces": (
        solid_beside(lambda step: step.surfaces(step.loose()), "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"),
        "1 loose face",
    ),
    "face across the solid": (solid_and(lambda step: step.surfaces(step.loose((0, 0.5, 1)))), "1 loose face"),
    "hidden face": (solid_and(hidden_face), "1 loose face"),
    "curves": (solid_beside(curves, WIRES), "1 curve"),
    "composite curve": (solid_and(Step.composite), "1 curve"),
    "styled curve": (
        solid_and(lambda step: step.styled(step.segment((5, 5, 5), (6, 6, 6))) and curves(step)),
        "1 curve",
    ),
    "point": (solid_and(lambda step: step.point((5, 5, 5))), "1 point"),
    "set": (
        solid_and(lambda step: step.set_of(step.segment((5, 5, 5), (6, 6, 6)), step.point((1, 1, 9)))),
        "1 curve, 1 point",
    ),
    "mesh": (with_a_mesh("SHELL"), "6 mesh faces"),
    "mesh of the solid": (with_a_mesh("SOLID"), "6 mesh faces"),
    "solid that is no B-rep": (
        solid_and(csg),
        "1 solid that is not read",
    ),
}


@pytest.mark.parametrize("case", BESIDE)
def test_the_solid_is_read_whatever_stands_beside_it(case, part, tmp_path):
    data, says = BESIDE[case]
    surface = read(tmp_path, data)
    assert surface.volume == pytest.approx(6.0) and np.allclose(surface.bbox, [[0, 0, 0], [1, 2, 3]])
    assert len(by_face(surface)) == 6
    assert [line for line in surface.notices if "left out" in line] == [f"left out beside the solid: {says}"]


def test_nothing_is_told_of_a_solid_alone(part, tmp_path):
    surface = read(tmp_path, of(box()))
    assert surface.volume == pytest.approx(6.0) and not surface.notices


@pytest.mark.parametrize(
    ("data", "there"),
    [
        (of(curves, kind=WIRES), "1 curve"),
        (of(lambda step: step.segment((5, 5, 5), (6, 6, 6)), kind=WIRES), "1 curve"),
        (of(lambda step: step.mesh("SHELL"), kind="TESSELLATED_SHAPE_REPRESENTATION"), "6 mesh faces"),
        (of(plane), "1 surface without an outline"),
    ],
)
def test_a_file_without_a_body_is_refused_by_what_is_there(data, there, part, tmp_path):
    with pytest.raises(MeshError, match=f"has no solid and no faces that bound a body, only {there}: export the solid"):
        read(tmp_path, data)


def test_a_solid_that_is_a_mesh_is_read_with_a_notice(part, tmp_path):
    surface = read(tmp_path, with_a_mesh(exact=False))
    assert surface.volume == pytest.approx(6.0) and len(by_face(surface)) == 6
    assert any("the solid is a mesh in the file" in line for line in surface.notices)


def test_faces_that_are_no_solid_are_sewn(part, tmp_path):
    """Two halves of a box, as loose shells without common edges."""
    step = Step()
    halves = [step.shell(BOX * (1, 2, 3), sides, "OPEN") for sides in (SIDES[:3], SIDES[3:])]
    step.part(step.surfaces(*halves), kind="MANIFOLD_SURFACE_SHAPE_REPRESENTATION")
    surface = read(tmp_path, step.data())
    assert surface.volume == pytest.approx(6.0)
    assert surface.brep.count(b"\nSo\n") == 1 and np.unique(surface.brep_faces).tolist() == [1, 2, 3, 4, 5, 6]


def test_solids_that_nearly_touch_are_glued(part, tmp_path):
    surface = read(tmp_path, of(box(), box(low=(1.0 + 1e-6, 0, 0))))
    assert surface.shells == 1 and len(surface.walls.corners) == 2


BODIES = {
    "inward": (lambda s: s.add(f"MANIFOLD_SOLID_BREP('',{s.shell(BOX * (1, 2, 3), [p[::-1] for p in SIDES])})")),
    "faceted": (lambda s: s.add(f"FACETED_BREP('',{s.shell(BOX * (1, 2, 3))})")),
    "closed shell": (lambda s: s.surfaces(s.shell(BOX * (1, 2, 3)))),
}


@pytest.mark.parametrize("case", BODIES)
def test_bodies_of_other_kinds_have_a_positive_volume(case, part, tmp_path):
    assert read(tmp_path, of(BODIES[case])).volume == pytest.approx(6.0)


def test_a_void_is_a_cavity_and_is_filled_where_it_is_asked(part, tmp_path):
    step = Step()
    outer, inner = step.shell(BOX * 9.0), step.shell(BOX * 3.0 + 1)
    turned = step.add(f"ORIENTED_CLOSED_SHELL('',*,{inner},.F.)")
    step.part(step.add(f"BREP_WITH_VOIDS('',{outer},({turned}))"))
    hollow = read(tmp_path, step.data())
    assert hollow.volume == pytest.approx(729.0 - 27.0) and hollow.shells == 2 and hollow.brep
    assert read(tmp_path, step.data(), component="largest").volume == pytest.approx(729.0)


APART = {"apart": (5, 0, 0), "on a face": (1, 0, 0), "on a part": (1, 0.5, 0.5), "on an edge": (1, 2, 0)}
APART |= {"across": (0.5, 0.5, 0.5), "inside": (0.25, 0.5, 0.5)}


WALLS = {"apart": 0.0, "on a face": 6.0, "on a part": 1.5 * 2.5, "on an edge": 0.0}  # areas


def check_both(surface, area):
    """Check two solids that touch over an area, on both of which the exact faces have it once."""
    assert surface.solids == ("base", "lid") and surface.volume == pytest.approx(12.0)
    walls = surface.walls.corners.reshape(-1, 3)
    assert normals_and_areas(walls, np.arange(len(walls)).reshape(-1, 3))[1].sum() == pytest.approx(area)
    assert surface.part.area(np.arange(len(surface.faces))) == pytest.approx(44.0 - 2 * area)
    assert np.array_equal(np.unique(surface.owners), [0, 1]) and np.all(surface.walls.solids == [0, 1])
    shared = int(area > 0)
    assert surface.brep.count(b"\nSo\n") == 2
    assert surface.brep.count(b"\nFa\n") == len(np.unique(surface.brep_faces)) + shared


@pytest.mark.parametrize("case", APART)
def test_several_solids_are_kept_unless_they_overlap(case, part, tmp_path):
    size = (0.5, 0.5, 0.5) if case == "inside" else (1, 2, 3)
    data = of(box(name="base"), box(size, APART[case], "lid"))
    if case in ("across", "inside"):
        with pytest.raises(MeshError, match=r"2 solids \(0: 'base', .*; 1: 'lid', .*\), 'base' and 'lid' overlap: "):
            read(tmp_path, data)
    else:
        check_both(read(tmp_path, data), WALLS[case])
    lid = read(tmp_path, data, component=1)
    assert lid.volume == pytest.approx(np.prod(size)) and np.allclose(lid.bbox[0], APART[case])
    assert any(line.startswith("solid 1 taken of 2 ") for line in lid.notices) and len(by_face(lid)) == 6
    assert read(tmp_path, data, component="largest").volume == pytest.approx(6.0)
    assert bodies_in(tmp_path / "part.step") == [0, 1]
    with pytest.raises(MeshError, match="component 2 does not exist: there are 2 solids"):
        read(tmp_path, data, component=2)
    with pytest.raises(MeshError, match="component must be a whole number"):
        read(tmp_path, data, component="lid")


def test_solids_in_the_same_place_are_one(part, tmp_path):
    surface = read(tmp_path, of(box(), box()))
    assert surface.volume == pytest.approx(6.0)
    assert "dropped copies of solids in the same place: 1" in surface.notices
    assert bodies_in(tmp_path / "part.step") == [None]


def test_a_shell_of_two_lumps_is_two_solids(part, tmp_path):
    step = Step()
    faces = [*step.faces(BOX, SIDES), *step.faces(BOX + 5, SIDES)]
    shell = step.add(f"CLOSED_SHELL('',{listed(faces)})")
    step.part(step.add(f"MANIFOLD_SOLID_BREP('',{shell})"))
    assert read(tmp_path, step.data()).solids == ("", "")


TURNED = ((9, 0, 0), (0, 1, 0), (0, 0, 1))  # its z is y, its x is z


def test_a_part_of_an_assembly_is_in_its_place(part, tmp_path):
    step = Step()
    inner = step.assembly((step.part(step.box(), name="bolt"), TURNED), name="inner")
    step.assembly((inner, ((0, 0, 100), (0, 0, 1), (1, 0, 0))))
    surface = read(tmp_path, step.data())
    assert surface.volume == pytest.approx(6.0) and np.allclose(surface.bbox, [[9, 0, 100], [11, 3, 101]])


def test_a_part_that_is_used_twice_is_two_solids_of_its_name(part, tmp_path):
    step = Step()
    bolt = step.part(step.box(), name="bolt")
    step.assembly((bolt, FRAME), (bolt, TURNED))
    assert read(tmp_path, step.data()).solids == ("bolt", "bolt")


AXES = ((9, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0))


@pytest.mark.parametrize("target", ["map", "relation"])
def test_a_shape_placed_by_an_operator_is_in_its_place_or_refused(target, part, tmp_path):
    """OpenCASCADE takes a mirror for a turn, and divides by a scale."""
    surface = read(tmp_path, placed(target, *AXES, "1."))
    assert surface.volume == pytest.approx(6.0) and np.allclose(surface.bbox, [[9, 0, 0], [12, 1, 2]])
    for operator in ((*AXES, "2."), ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, -1), "1.")):
        with pytest.raises(MeshError, match="places a shape by a mirror or a scale"):
            read(tmp_path, placed(target, *operator))


@pytest.mark.parametrize(
    ("lengths", "name"),
    [
        (metric("KILO"), "km"),
        (metric("MEGA"), "Mm"),
        (metric("MICRO"), "micron"),
        (metric("NANO"), "nm"),
        (metric("FEMTO"), "fm"),
        (converted("INCH", 2.54, metric("CENTI")), "in"),
        (converted("MILE", 1609344), "mi"),
        (converted("YARD", 0.9144, metric()), "yd"),
        (converted("MIL", 0.0254), "mil"),
        (converted("MICROINCH", 2.54e-5), "microinch"),
    ],
)
def test_a_step_box_is_as_large_in_every_unit(lengths, name, part, tmp_path):
    step = Step(*lengths)
    step.part(step.box())
    surface = read(tmp_path, step.data())
    assert (surface.unit, surface.summary()["unit"]) == (name, name)
    assert surface.volume == pytest.approx(6.0) and np.allclose(surface.bbox, [[0, 0, 0], [1, 2, 3]])


@pytest.mark.parametrize(
    ("flag", "label", "name"),
    [
        ("5", "2HMI", "mi"),
        ("7", "2HKM", "km"),
        ("8", "3HMIL", "mil"),
        ("9", "2HUM", "micron"),
        ("11", "3HUIN", "microinch"),
        ("3", "2HYD", "yd"),
        ("3", "2HCM", "cm"),
        ("3", "5HCUBIT", "mm"),
        ("", "", "in"),
    ],
)
def test_an_iges_bracket_is_as_large_in_every_unit(flag, label, name, part, tmp_path):
    surface = read(tmp_path, with_unit(part("iges"), flag, label), "part.iges")
    assert surface.unit == name and surface.volume == pytest.approx(VOLUME, rel=1e-3)
    assert np.allclose(surface.bbox, [[0, 0, 0], [8, 4, 5]], atol=1e-9)
    assert any("lengths are taken as mm" in line for line in surface.notices) == (label == "5HCUBIT")


def test_solids_of_iges_are_read_beside_a_loose_face(part, tmp_path):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pln
    from OCP.IGESControl import IGESControl_Writer

    writer = IGESControl_Writer("MM", 1)  # 1: as solids
    writer.AddShape(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape())
    writer.AddShape(BRepBuilderAPI_MakeFace(gp_Pln(), 5.0, 6.0, 5.0, 6.0).Face())
    writer.ComputeModel()
    writer.Write(str(tmp_path / "part.iges"))
    surface = load_surface(tmp_path / "part.iges")
    assert surface.volume == pytest.approx(6.0) and "left out beside the solid: 1 loose face" in surface.notices


def test_an_assembly_in_two_units_is_told_by_its_solids(part, tmp_path):
    assert read(tmp_path, crowded(3)).solids == ("bolt", "bolt", "nut")
    nut = read(tmp_path, crowded(3), component=2)
    assert nut.unit == "mm" and np.allclose(nut.bbox, [[30, 0, 0], [40, 20, 30]])
    assert "lengths are in mm: the file has several units (cm, in)" in nut.notices
    bolt = read(tmp_path, crowded())
    assert bolt.unit == "in" and bolt.volume == pytest.approx(6.0)
    assert "left out beside the solid: 1 loose face, 6 mesh faces, 1 annotation" in bolt.notices


def test_lengths_of_a_unit_without_a_name_are_in_mm(part, tmp_path):
    step = Step(*converted("US SURVEY FOOT", 304.8006096))
    step.part(step.box())
    surface = read(tmp_path, step.data())
    assert surface.unit == "mm" and np.allclose(surface.bbox[1], 304.8006096 * np.array([1, 2, 3]), rtol=1e-9)
    assert any(line.startswith("lengths are in mm: the file's unit, 'US SURVEY FOOT'") for line in surface.notices)


def test_parts_in_several_units_are_in_mm(part, tmp_path):
    step = Step()
    inch = step.units(*converted("INCH", 25.4))
    step.part(step.box(name="mm"))
    step.part(step.box(name="in"), context=inch)
    surface = read(tmp_path, step.data(), component="largest")
    assert surface.unit == "mm" and surface.volume == pytest.approx(6 * 25.4**3)


def test_a_solid_without_a_face_is_open(part, tmp_path):
    step = Step()
    step.part(step.add(f"MANIFOLD_SOLID_BREP('',{step.shell(BOX, SIDES[1:])})"))
    with pytest.raises(MeshError, match="open surface: 1 boundary loop"):
        read(tmp_path, step.data())


def test_what_is_too_small_for_opencascade_is_refused(part, tmp_path):
    step = Step()
    step.part(step.box(np.array([1, 2, 3]) * 1e-6))
    with pytest.raises(MeshError, match="too small for OpenCASCADE: choose a smaller unit"):
        read(tmp_path, step.data())


def test_a_damaged_file_is_refused_in_one_line(tmp_path, capfd):
    pytest.importorskip("OCP")
    path = tmp_path / "bracket.step"
    path.write_bytes(solid_model()[:9000])
    capfd.readouterr()
    with pytest.raises(MeshError, match="bracket.step: OpenCASCADE cannot read it as STEP"):
        load_surface(path)
    assert capfd.readouterr() == ("", "")


CORNERS = BOX * (1, 2, 3)
ROWS = np.array([[q[0], q[k], q[k + 1]] for q in SIDES for k in (1, 2)])
FACTS = {
    "what": "solid",
    "left_out": {},
    "names": [""],
    "overlap": None,
    "failed": False,
    "size": 4.0,
    "states": {"": 1},
    "missing": [],
    "changed": False,
    "shapes": [],
}


@pytest.fixture
def found(monkeypatch):
    """What OpenCASCADE finds in a file: a box, with these facts."""

    def find(**facts):
        faces = np.repeat(np.arange(1, 7), 2)
        labels = np.stack([faces, np.ones(12, dtype=int), faces, faces], axis=1)
        arrays = {"vertices": CORNERS, "faces": ROWS, "labels": labels}
        monkeypatch.setattr(cad, "_run", lambda *asked: (arrays, FACTS | facts))
        return cad.read_step(SurfaceFile(of(box()), 1000, None))

    return find


def test_what_opencascade_finds_becomes_triangles_groups_and_notices(found):
    content = found()
    assert (content.notices, content.unit, len(content.solids)) == ((), "mm", 1) and content.polygons == ROWS.tolist()
    assert list(content.groups) == [f"face{k}" for k in range(1, 7)]
    beside = {"loose face": 2, "curve": 1, "other entity": 3}
    assert found(left_out=beside).notices == ("left out beside the solid: 2 loose faces, 1 curve, 3 other entities",)


@pytest.mark.parametrize(("state", "says"), [("healed", "healed it"), ("invalid", "cannot heal it")])
def test_a_fault_of_a_solid_is_told(state, says, found):
    (notice,) = found(states={state: 1}).notices
    assert notice.startswith("OpenCASCADE f") and says in notice


def test_faces_without_triangles_are_refused_by_name(found):
    with pytest.raises(
        MeshError, match="OpenCASCADE cannot divide face3, face7 into triangles: repair it, or export tri"
    ):
        found(missing=[3, 7])


def test_without_opencascade_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cad, "find_spec", lambda name: None)
    path = tmp_path / "part.step"
    path.write_text("ISO-10303-21;\n")
    assert main(["check", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(
        "part.step: reading .step needs OpenCASCADE, which is not installed: pip install cadquery-ocp-novtk"
    )


def test_deflection_is_for_solid_models(capsys):
    assert main(["check", "cube", "--deflection", "0.1"]) == 2
    assert "cube: deflection is for files of solid models" in capsys.readouterr().err


def test_a_coordinate_that_is_no_number_is_refused(tmp_path):
    path = tmp_path / "nan.step"
    path.write_bytes(BRACKET.read_bytes().replace(b"CARTESIAN_POINT('',(", b"CARTESIAN_POINT('',(NaN,", 1))
    with pytest.raises(MeshError, match="holds a coordinate that is no number"):
        load_surface(path)
