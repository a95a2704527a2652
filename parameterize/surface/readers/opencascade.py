"""A program of its own: the solids of a STEP or IGES file to the arrays of their triangles, by OpenCASCADE.

`cad.py` runs it with the file, the .npz to write, the kind, the millimetres of the unit in which lengths are wanted,
the deflection in that unit, 0 for a share of the box's diagonal, that share, the angle between triangles in radians,
and how many of that unit the file's has. It imports OCP and numpy alone.
"""

import io
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BOPAlgo import BOPAlgo_Builder
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing, BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepLib import BRepLib
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder, GeomAbs_Plane, GeomAbs_Sphere, GeomAbs_Torus
from OCP.gp import gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.ShapeFix import ShapeFix_Shape
from OCP.STEPControl import STEPControl_Reader
from OCP.StepGeom import StepGeom_CartesianTransformationOperator3d
from OCP.StepRepr import (
    StepRepr_MappedItem,
    StepRepr_NextAssemblyUsageOccurrence,
    StepRepr_RepresentationItem,
    StepRepr_RepresentationRelationshipWithTransformation,
)
from OCP.StepShape import StepShape_ShapeRepresentation, StepShape_SolidModel
from OCP.TopAbs import (
    TopAbs_COMPOUND,
    TopAbs_COMPSOLID,
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_REVERSED,
    TopAbs_SHAPE,
    TopAbs_SHELL,
    TopAbs_SOLID,
    TopAbs_VERTEX,
)
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Iterator
from OCP.TopTools import TopTools_FormatVersion

CLOSE = 1e-6  # of the box's diagonal: solids that are as close touch
SEWN = 1e-5  # of the box's diagonal: gaps between the faces of a model without solids that are sewn
FINEST = 1e-6  # of the box's diagonal: finer triangles take minutes
LEAST = 1e-6  # of its unit: its tolerance is a tenth of that, and smaller deflections are refused
NO_AREA = 1e-10  # of the square of the diagonal: a face that needs no triangles, as its neighbours meet over it

ROUND = {
    GeomAbs_Cylinder: "cylinder",
    GeomAbs_Cone: "cone",
    GeomAbs_Sphere: "sphere",
    GeomAbs_Torus: "torus",
}

Arrays = dict[str, Any]


@dataclass(frozen=True, eq=False)
class ShapeKey:
    """A part of a shape, which is the same part whichever way it is turned."""

    shape: Any

    def __hash__(self) -> int:
        return hash(self.shape)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ShapeKey) and bool(self.shape.IsSame(other.shape))


def parts(shape: Any, kind: Any, outside: Any = TopAbs_SHAPE) -> dict[ShapeKey, Any]:
    """Return the distinct parts of a kind with their shapes, in their order; those in an `outside` are passed over."""
    explorer, found = TopExp_Explorer(shape, kind, outside), dict[ShapeKey, Any]()
    while explorer.More():
        found.setdefault(ShapeKey(explorer.Current()), explorer.Current())
        explorer.Next()
    return found


def compound(shapes: Iterable[Any]) -> Any:
    """Return one shape of several."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def diagonal(shape: Any) -> float:
    """Return the diagonal of a shape's box."""
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    return float(box.SquareExtent() ** 0.5)


def is_mesh(shape: Any) -> bool:
    """Return whether faces are triangles of the file rather than pieces of surfaces."""
    return all(BRep_Tool.Surface_s(TopoDS.Face(face)) is None for face in parts(shape, TopAbs_FACE).values())


def entities(model: Any) -> Iterator[Any]:
    """Yield the entities of a file."""
    return (model.Value(number) for number in range(1, model.NbEntities() + 1))


def names_of(shape: Any, reader: Any, above: str = "") -> Iterator[tuple[ShapeKey, str]]:
    """Yield the solids of a shape with their names or those of their products; `above` is the name of what has it."""
    entity = reader.WS().TransferReader().EntityFromShapeResult(shape, -1)
    names = [entity.Name()] if isinstance(entity, StepRepr_RepresentationItem) else []
    if isinstance(entity, StepRepr_NextAssemblyUsageOccurrence):
        names = [entity.Name(), entity.RelatedProductDefinition().Formation().OfProduct().Name()]
    own = next((name.ToCString() for name in names if name is not None and not name.IsEmpty()), above)
    if shape.ShapeType() == TopAbs_SOLID:
        yield ShapeKey(shape), own
    elif shape.ShapeType() in (TopAbs_COMPOUND, TopAbs_COMPSOLID):
        inside = TopoDS_Iterator(shape)
        while inside.More():
            yield from names_of(inside.Value(), reader, own)
            inside.Next()


def is_changed(operator: Any) -> bool:
    """Return whether a placement has a scale, or is a mirror: OpenCASCADE applies neither rightly."""
    if not isinstance(operator, StepGeom_CartesianTransformationOperator3d):
        return False
    axes = (operator.Axis1(), operator.Axis2(), operator.Axis3())
    rows = [[axis.DirectionRatiosValue(k) for k in (1, 2, 3)] for axis in axes if axis is not None]
    mirrored = len(rows) == 3 and np.linalg.det(rows) < 0.0
    return bool(mirrored or (operator.HasScale() and operator.Scale() != 1.0))


def placements(model: Any) -> Iterator[Any]:
    """Yield by what shapes of a STEP file are placed into others: operators of mapped items and of relations."""
    for entity in entities(model):
        if isinstance(entity, StepShape_ShapeRepresentation):
            items = (entity.ItemsValue(number) for number in range(1, entity.NbItems() + 1))
            yield from (item.MappingTarget() for item in items if isinstance(item, StepRepr_MappedItem))
        elif isinstance(entity, StepRepr_RepresentationRelationshipWithTransformation):
            yield entity.TransformationOperator().Value()


def unread(reader: Any) -> int:
    """Return how many solids of a STEP file OpenCASCADE makes no shape of."""
    process = reader.WS().TransferReader().TransientProcess()
    mapped = range(1, process.NbMapped() + 1)
    made = sum(isinstance(process.Mapped(k), StepShape_SolidModel) and process.MapItem(k).HasResult() for k in mapped)
    return sum(isinstance(entity, StepShape_SolidModel) for entity in entities(reader.StepModel())) - made


def healed(solid: Any) -> tuple[Any, str]:
    """Return a valid solid, repaired where it is not valid and that helps, and what was done: "", healed or invalid."""
    if BRepCheck_Analyzer(solid).IsValid():
        return solid, ""
    fix = ShapeFix_Shape(solid)
    fix.Perform()
    found = fix.Shape()
    if found.ShapeType() == TopAbs_SOLID and BRepCheck_Analyzer(found).IsValid():
        return found, "healed"
    return solid, "invalid"


def sewn(whole: Any) -> Any:
    """Return the faces of a model without solids with common edges."""
    sewing = BRepBuilderAPI_Sewing(SEWN * diagonal(whole))
    sewing.Add(whole)
    sewing.Perform()
    return sewing.SewedShape()


def filled(shape: Any) -> Any:
    """Return the solid inside the faces of a shape, if they are one closed shell, else the shape."""
    shells = [TopoDS.Shell(shell) for shell in parts(shape, TopAbs_SHELL).values()]
    if len(shells) != 1 or not BRep_Tool.IsClosed_s(shells[0]) or parts(shape, TopAbs_FACE, TopAbs_SHELL):
        return shape
    solid = BRepBuilderAPI_MakeSolid(shells[0]).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return solid


def bodies_of(shape: Any) -> tuple[list[Any], str]:
    """Return the solids of a shape and "solid"; those that are meshes and "mesh"; else its faces, sewn, and "faces"."""
    solids = list(parts(shape, TopAbs_SOLID).values())
    exact = [solid for solid in solids if not is_mesh(solid)]
    if solids:
        return exact or solids, "solid" if exact else "mesh"
    faces = [face for face in parts(shape, TopAbs_FACE).values() if not is_mesh(face)]
    return [filled(sewn(compound(faces)))] if faces else [], "faces"


@dataclass(frozen=True, eq=False)
class Bodies:
    """Bodies, and where their faces come from.

    shapes: those given, with common faces where they touch. origins: for each its faces, with the numbers from 1 on
    that they have among the faces of all given ones and of the given one. overlap: the numbers of two that overlap.
    failed: whether common faces were not found. In both cases there are none.
    """

    shapes: list[Any]
    origins: list[dict[ShapeKey, tuple[int, int]]]
    overlap: tuple[int, int] | None = None
    failed: bool = False


def as_given(bodies: list[Any], **facts: Any) -> Bodies:
    """Return bodies as they are."""
    return Bodies(bodies, origins(bodies, lambda face: [face]), **facts)


def origins(bodies: list[Any], made_of: Callable[[Any], list[Any]]) -> list[dict[ShapeKey, tuple[int, int]]]:
    """Return, for each body, what its faces were made into, with the number of the face among all and of the body."""
    found, number = [], 0
    for body in bodies:
        faces = enumerate(parts(body, TopAbs_FACE).values(), start=1)
        found.append({ShapeKey(one): (number + own, own) for own, face in faces for one in made_of(face)})
        number += len(parts(body, TopAbs_FACE))
    return found


def glued(bodies: list[Any]) -> Bodies:
    """Return solids with common faces where they touch, by the general fuse; as they are where they overlap."""
    fuse = BOPAlgo_Builder()
    for body in bodies:
        fuse.AddArgument(body)
    fuse.SetNonDestructive(True)
    fuse.SetFuzzyValue(CLOSE * diagonal(compound(bodies)))
    fuse.Perform()
    if fuse.HasErrors():
        return as_given(bodies, failed=True)

    def made_of(shape: Any) -> list[Any]:
        return list(fuse.Modified(shape)) or [shape]

    cells = [made_of(body) for body in bodies]
    owners: dict[ShapeKey, int] = {}
    for number, found in enumerate(cells):
        for cell in found:
            first = owners.setdefault(ShapeKey(cell), number)
            if first != number and len(found) + len(cells[first]) > 2:
                return as_given(bodies, overlap=(first, number))
    if any(len(found) > 1 for found in cells):
        return as_given(bodies, failed=True)
    return Bodies([found[0] for found in cells], origins(bodies, made_of))


def left_out(shape: Any, bodies: list[Any], kind: str) -> Counter[str]:
    """Return how many faces, curves and points of a shape are in none of the bodies that were taken of it."""
    faces = parts(shape, TopAbs_FACE)
    taken = {part for body in bodies for part in parts(body, TopAbs_FACE)}
    beside = [face for part, face in faces.items() if part not in taken and (kind != "faces" or is_mesh(face))]
    edges = set(parts(shape, TopAbs_EDGE, TopAbs_FACE))
    if edges:
        edges.difference_update(parts(compound(faces.values()), TopAbs_EDGE))
    points = parts(shape, TopAbs_VERTEX, TopAbs_EDGE)
    meshes = sum(map(is_mesh, beside))
    return +Counter(
        {"loose face": len(beside) - meshes, "mesh face": meshes, "curve": len(edges), "point": len(points)}
    )


def triangles(bodies: Bodies) -> tuple[Arrays, list[tuple[int, float]]]:
    """Return arrays, and the faces without triangles with their areas.

    vertices: (n, 3). faces: (m, 3), triangles. labels: (m, 4), of each the face as it was given, the body, the face
    among those of the body as it was given, and the face of all bodies together, counted from 1.
    """
    points: list[tuple[float, float, float]] = []
    corners: list[tuple[int, ...]] = []
    labels: list[tuple[int, int, int, int]] = []
    missing: list[tuple[int, float]] = []
    together = {part: number for number, part in enumerate(parts(compound(bodies.shapes), TopAbs_FACE), start=1)}
    for owner, (body, given) in enumerate(zip(bodies.shapes, bodies.origins, strict=True), start=1):
        for part, shape in parts(body, TopAbs_FACE).items():
            face, place, (number, own) = TopoDS.Face(shape), TopLoc_Location(), given[part]
            found = BRep_Tool.Triangulation_s(face, place)
            if found is None or not found.NbTriangles():
                missing.append((number, area(face)))
                continue
            first, where = len(points) - 1, place.Transformation()
            for k in range(1, found.NbNodes() + 1):
                node = found.Node(k).Transformed(where)
                points.append((node.X(), node.Y(), node.Z()))
            for k in range(1, found.NbTriangles() + 1):
                row = tuple(first + corner for corner in found.Triangle(k).Get())
                corners.append(row[::-1] if face.Orientation() == TopAbs_REVERSED else row)
                labels.append((number, owner, own, together[part]))
    arrays = {
        "vertices": np.array(points, dtype=float).reshape(-1, 3),
        "faces": np.array(corners, dtype=int).reshape(-1, 3),
        "labels": np.array(labels, dtype=int).reshape(-1, 4),
    }
    return arrays, missing


def shapes_of(bodies: list[Any], factor: float) -> list[dict[str, Any]]:
    """Return the shape of each face of the given bodies, in a unit of `factor` of its own; see `face_shapes.py`."""
    faces = (face for body in bodies for face in parts(body, TopAbs_FACE).values())
    return [shape_of(TopoDS.Face(face), factor) for face in faces]


def shape_of(face: Any, factor: float) -> dict[str, Any]:
    """Return the kind of a face's surface, its place, and of a round one its radius, its turn and its side."""
    surface = BRepAdaptor_Surface(face)
    kind = surface.GetType()
    spans = surface.FirstUParameter(), surface.LastUParameter(), surface.FirstVParameter(), surface.LastVParameter()
    point, along, across = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(0.5 * (spans[0] + spans[1]), 0.5 * (spans[2] + spans[3]), point, along, across)
    normal = row(along.Crossed(across)) * (-1.0 if face.Orientation() == TopAbs_REVERSED else 1.0)
    if kind == GeomAbs_Plane:
        return {"kind": "plane", "centre": list(row(point) / factor), "normal": list(unit(normal))}
    if kind not in ROUND:
        return {"kind": "free"}
    name, element = ROUND[kind], getattr(surface, ROUND[kind].capitalize())()
    centre, turn = row(element.Location()), spans[1] - spans[0]
    found = {"kind": name, "centre": list(centre / factor), "turn": turn}
    if name != "sphere":
        found["axis"] = list(row(element.Axis().Direction()))
    middle = centre
    if name == "torus":
        found |= {"radius": element.MinorRadius() / factor, "ring": element.MajorRadius() / factor}
        flat = row(point) - centre - np.dot(row(point) - centre, found["axis"]) * np.array(found["axis"])
        middle = centre + element.MajorRadius() * unit(flat)
    elif name == "cone":
        found["angle"] = abs(element.SemiAngle())
    else:
        found["radius"] = element.Radius() / factor
    away = row(point) - middle
    if "axis" in found and name != "torus":
        away = away - np.dot(away, found["axis"]) * np.array(found["axis"])
    return found | {"hollow": bool(np.dot(normal, away) < 0.0)}


def row(vector: Any) -> Any:
    """Return the coordinates (3,) of a point, a vector or a direction."""
    return np.array([vector.X(), vector.Y(), vector.Z()])


def unit(vector: Any) -> Any:
    """Return a vector (3,) of length 1; zero stays."""
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


def area(face: Any) -> float:
    """Return the area of a face."""
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, found)
    return float(found.Mass())


def brep(shape: Any, factor: float) -> Any:
    """Return the text of a shape in the BREP format of OpenCASCADE, in a unit of `factor` of its own: bytes (n,)."""
    scale, text = gp_Trsf(), io.BytesIO()
    scale.SetScale(gp_Pnt(), 1.0 / factor)
    scaled = shape if factor == 1.0 else BRepBuilderAPI_Transform(shape, scale, True).Shape()
    BRepTools.Write_s(scaled, text, False, False, TopTools_FormatVersion.TopTools_FormatVersion_VERSION_1)
    return np.frombuffer(text.getvalue(), dtype=np.uint8)


def read(path: str, kind: str, millimetres: float) -> tuple[Any, Counter[str]] | None:
    """Return the reader of a file, in a unit, and of what it makes no shape; None where it cannot be read."""
    reader = STEPControl_Reader() if kind == "step" else IGESControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone:
        return None
    if kind == "step":
        reader.SetSystemLengthUnit(millimetres)
    else:
        section = reader.IGESModel().GlobalSection()
        section.SetCascadeUnit(millimetres)
        reader.IGESModel().SetGlobalSection(section)
    lost = Counter({"other entity": reader.NbRootsForTransfer() - reader.TransferRoots()})
    if kind == "step":
        lost["solid that is not read"] = unread(reader)
    return reader, lost


def main(
    source: str, target: str, kind: str, millimetres: str, deflection: str, share: str, angle: str, factor: str
) -> None:
    """Write the arrays of `triangles`, `breps` and `facts`, a text of JSON; nothing where the file cannot be read.

    breps: of the solids, the text of all together, brep0, and of each, brep1, brep2, ...
    """
    content = read(source, kind, float(millimetres))
    if content is None:
        return
    reader, lost = content
    shape = compound([]) if reader.OneShape().IsNull() else reader.OneShape()
    bodies, what = bodies_of(shape)
    beside = left_out(shape, bodies, what) + lost
    known = dict(names_of(shape, reader))
    names = [known.get(ShapeKey(body), "") for body in bodies] if what != "faces" else []
    states: list[str] = []
    if what == "solid":
        bodies, states = map(list, zip(*map(healed, bodies), strict=True))
    found = glued(bodies) if len(bodies) > 1 and what == "solid" else as_given(bodies)
    size = diagonal(compound(bodies)) if bodies else 0.0
    if 0.0 < float(deflection) < FINEST * size:
        said = (
            f"deflection must be at least a millionth of the box's diagonal, {FINEST * size / float(factor):.3g} here"
        )
        np.savez(target, facts=np.array(json.dumps({"refused": said})))
        return
    wanted = max(float(deflection) or float(share) * size, LEAST)
    for body in found.shapes:
        BRepMesh_IncrementalMesh(body, wanted, False, float(angle), False)
    arrays, areas = triangles(found)
    facts = {
        "what": what,
        "left_out": beside,
        "names": names,
        "shapes": shapes_of(bodies, float(factor)) if what != "mesh" else [],
        "size": size,
        "states": Counter(states),
        "missing": [number for number, lost_area in areas if lost_area > NO_AREA * size**2],
        "overlap": found.overlap,
        "failed": found.failed,
        "changed": kind == "step" and any(map(is_changed, placements(reader.StepModel()))),
    }
    solids = parts(compound(found.shapes), TopAbs_SOLID).values() if what != "mesh" else []
    shapes = [compound(solids), *bodies] if solids else []
    breps = {f"brep{k}": brep(shape, float(factor)) for k, shape in enumerate(shapes)}
    np.savez(target, facts=np.array(json.dumps(facts)), **arrays, **breps)


if __name__ == "__main__":
    main(*sys.argv[1:])
