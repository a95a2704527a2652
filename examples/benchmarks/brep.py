"""The exact solids of a STEP file, by OpenCASCADE: points on faces and sharp edges, corners, distances, volume.

All lengths are those of the file's unit. Where the file has triangles instead of surfaces, these are the part, and it
has no edges.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import igl
import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.Extrema import Extrema_GenLocateExtPS
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.IntTools import IntTools_FClass2d
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_IN, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from parameterize.surface.readers.cad_units import step_unit
from parameterize.surface.readers.opencascade import ShapeKey, bodies_of, compound, diagonal, parts

SHARP = 20.0  # degrees between the normals of two faces
FINENESS = 5e-5  # of the diagonal: deflection of the triangles that say which face is near
ON_EDGE = 33  # points of a sharp edge
POLE = 1e-6  # of the longest normal along an edge
FARTHEST = 500  # points whose distance is confirmed by a search over the whole face
VOLUME_ERROR = 1e-6  # relative, of the integral over a face


@dataclass(frozen=True, eq=False)
class Brep:
    """The solids of a file."""

    solids: tuple[Any, ...]
    factor: float  # of the file's unit in that in which OpenCASCADE works
    is_mesh: bool = False

    @classmethod
    def load(cls, path: Path) -> Brep:
        """Read a STEP file. Raises ValueError where it has no solid."""
        unit, reader = step_unit(path.read_bytes()), STEPControl_Reader()
        if reader.ReadFile(str(path)) != IFSelect_RetDone:
            raise ValueError(f"{path}: cannot be read")
        reader.SetSystemLengthUnit(unit.working)
        reader.TransferRoots()
        solids, kind = bodies_of(reader.OneShape())
        if not solids:
            raise ValueError(f"{path}: no solid")
        return cls(tuple(solids), unit.factor, kind == "mesh")

    @cached_property
    def whole(self) -> Any:
        """Return one shape of all solids."""
        return compound(self.solids)

    @cached_property
    def diagonal(self) -> float:
        """Return the diagonal of the box."""
        return diagonal(self.whole) / self.factor

    @property
    def is_valid(self) -> bool:
        """Return whether OpenCASCADE finds no fault."""
        return bool(BRepCheck_Analyzer(self.whole).IsValid())

    @property
    def volume(self) -> float:
        """Return the volume, by adaptive integration over the exact faces, or that inside the triangles."""
        found = GProp_GProps()
        given = (False, False, True) if self.is_mesh else (VOLUME_ERROR,)
        BRepGProp.VolumeProperties_s(self.whole, found, *given)
        return abs(float(found.Mass())) / self.factor**3

    @cached_property
    def faces(self) -> list[Any]:
        """Return the faces of all solids, each once."""
        return [TopoDS.Face(face) for face in parts(self.whole, TopAbs_FACE).values()]

    @cached_property
    def triangles(self) -> Triangles:
        """Return triangles of all faces, with the parameters of their corners: fine ones of exact faces."""
        if not self.is_mesh:
            BRepTools.Clean_s(self.whole)  # of the triangles that the file has beside them
            BRepMesh_IncrementalMesh(self.whole, FINENESS * diagonal(self.whole), False, 0.2, False)
        return Triangles.of(self.faces)

    def surface_points(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return points (m, 3) exactly on faces: half of them spread by area, half one a triangle."""
        area = self.triangles.areas
        spread = rng.choice(len(area), count // 2, p=area / area.sum())
        each = rng.permutation(len(area))[: count - count // 2]
        weights = rng.dirichlet((1.0, 1.0, 1.0), len(spread))
        weights = np.concatenate([0.98 * weights + 0.02 / 3.0, np.full((len(each), 3), 1.0 / 3.0)])
        chosen = np.concatenate([spread, each])
        if self.is_mesh:
            return np.einsum("nk,nkx->nx", weights, self.triangles.points[chosen]) / self.factor
        parameters = np.einsum("nk,nkx->nx", weights, self.triangles.parameters[chosen])
        found = np.empty((len(chosen), 3))
        for face, rows in by_value(self.triangles.face[chosen]):
            surface, point = BRepAdaptor_Surface(self.faces[face]), gp_Pnt()
            for row in rows.tolist():
                surface.D0(*parameters[row].tolist(), point)
                found[row] = point.X(), point.Y(), point.Z()
        return found / self.factor

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distances (n,) of points (n, 3) from the exact faces.

        The face is that of the nearest triangle. The foot is found by Newton's method from there. Where it is not
        inside the face's outline, and for the farthest points, the distance is that of the trimmed face.
        """
        if self.is_mesh:
            return self.mesh_distances(points)
        points = points * self.factor
        _, parameters, numbers = self.triangles.nearest(points)
        faces = {number: FaceDistance(self.faces[number]) for number in np.unique(numbers).tolist()}
        rows = zip(numbers.tolist(), points, parameters, strict=True)
        found = np.array([faces[number].near(point, start) for number, point, start in rows])
        for row in np.argsort(-found)[:FARTHEST].tolist():
            found[row] = min(found[row], faces[int(numbers[row])].trimmed(points[row]))
        return found / self.factor

    def mesh_distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distances (n,) of points (n, 3) from the triangles."""
        return self.triangles.nearest(points * self.factor)[0] / self.factor

    @cached_property
    def sharp_edges(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return points (ON_EDGE, 3) of each edge with a sharp place, and where (ON_EDGE,) the edge is sharp."""
        found = []
        for solid in () if self.is_mesh else self.solids:
            for places, normals in _edges(solid):
                cosine = np.clip((normals[0] * normals[1]).sum(axis=1), -1.0, 1.0)
                sharp = np.degrees(np.arccos(cosine)) > SHARP
                if sharp.any():
                    found.append((places / self.factor, sharp))
        return found

    @property
    def sharp_points(self) -> np.ndarray:
        """Return the points (n, 3) of edges where they are sharp."""
        return np.concatenate([points[sharp] for points, sharp in self.sharp_edges] or [np.zeros((0, 3))])

    @property
    def corners(self) -> np.ndarray:
        """Return the points (n, 3) where sharp edges meet, other than two that go on into each other."""
        ends: list[np.ndarray] = []
        ways: list[np.ndarray] = []
        for points, sharp in self.sharp_edges:
            for end, next_one, is_sharp in ((0, 1, sharp[1]), (-1, -2, sharp[-2])):
                if is_sharp:
                    ends.append(points[end])
                    ways.append(_unit(points[next_one] - points[end]))
        return corners_of(np.array(ends).reshape(-1, 3), np.array(ways).reshape(-1, 3), 1e-6 * self.diagonal)


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles of faces. points, parameters: (m, 3, 3) and (m, 3, 2) of their corners; face: (m,)."""

    points: np.ndarray
    parameters: np.ndarray
    face: np.ndarray

    @classmethod
    def of(cls, faces: list[Any]) -> Triangles:
        """Return the triangles that OpenCASCADE keeps with its faces."""
        points, parameters, owners = [], [], []
        for number, face in enumerate(faces):
            place = TopLoc_Location()
            mesh = BRep_Tool.Triangulation_s(face, place)
            if mesh is None:
                continue
            nodes = range(1, mesh.NbNodes() + 1)
            moved = (mesh.Node(k).Transformed(place.Transformation()) for k in nodes)
            own = np.array([(p.X(), p.Y(), p.Z()) for p in moved])
            on_plane = map(mesh.UVNode if mesh.HasUVNodes() else mesh.Node, nodes)
            plane = np.array([(p.X(), p.Y()) for p in on_plane])
            corners = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)]) - 1
            points.append(own[corners])
            parameters.append(plane[corners])
            owners.append(np.full(len(corners), number))
        return cls(np.concatenate(points), np.concatenate(parameters), np.concatenate(owners))

    @cached_property
    def areas(self) -> np.ndarray:
        """Return the areas (m,)."""
        a, b, c = self.points.swapaxes(0, 1)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return distance (n,), parameters (n, 2) and face (n,) of the nearest points on triangles."""
        flat = np.ascontiguousarray(self.points.reshape(-1, 3))
        corners = np.arange(len(flat)).reshape(-1, 3)
        squared, which, feet = igl.point_mesh_squared_distance(np.ascontiguousarray(points), flat, corners)
        a, b, c = (np.ascontiguousarray(self.points[which, k]) for k in range(3))
        weights = igl.barycentric_coordinates(np.ascontiguousarray(feet), a, b, c)
        parameters = np.einsum("nk,nkx->nx", weights, self.parameters[which])
        return np.sqrt(np.maximum(squared, 0.0)), parameters, self.face[which]


class FaceDistance:
    """The distance of a point from a trimmed face."""

    def __init__(self, face: Any) -> None:
        self.face = face
        self.surface = BRepAdaptor_Surface(face)
        self.outline = IntTools_FClass2d(face, 1e-7)
        self.search = Extrema_GenLocateExtPS(self.surface, 1e-10, 1e-10)

    def near(self, point: np.ndarray, start: np.ndarray) -> float:
        """Return the distance of a point (3,) from the surface near parameters (2,), or from the trimmed face."""
        self.search.Perform(gp_Pnt(*point.tolist()), *start.tolist(), True)
        if self.search.IsDone():
            foot = gp_Pnt2d(*self.search.Point().Parameter())
            if self.outline.Perform(foot) == TopAbs_IN:
                return float(self.search.SquareDistance() ** 0.5)
        return self.trimmed(point)

    def trimmed(self, point: np.ndarray) -> float:
        """Return the distance of a point (3,) by OpenCASCADE's search over face and outline, which takes long."""
        vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()
        return float(BRepExtrema_DistShapeShape(vertex, self.face).Value())


def by_value(values: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Yield each distinct value with its places."""
    order = np.argsort(values, kind="stable")
    found, first = np.unique(values[order], return_index=True)
    yield from zip(found.tolist(), np.split(order, first[1:]), strict=True)


def _edges(solid: Any) -> Iterator[tuple[np.ndarray, list[np.ndarray]]]:
    """Yield points of each edge between two faces, with the normals of both there."""
    normals: dict[ShapeKey, list[np.ndarray]] = defaultdict(list)
    for face in parts(solid, TopAbs_FACE).values():
        own = TopoDS.Face(face)
        for key, edge in parts(own, TopAbs_EDGE).items():
            if not BRep_Tool.Degenerated_s(TopoDS.Edge(edge)):
                normals[key].append(_normals(TopoDS.Edge(edge), own))
    for key, found in normals.items():
        if len(found) == 2:
            yield _curve_points(TopoDS.Edge(key.shape)), found


def _curve_points(edge: Any) -> np.ndarray:
    curve = BRepAdaptor_Curve(edge)
    places = map(curve.Value, np.linspace(curve.FirstParameter(), curve.LastParameter(), ON_EDGE).tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in places])


def _normals(edge: Any, face: Any) -> np.ndarray:
    """Return the outward normals of a face along one of its edges; not finite where the face has none."""
    line, surface = BRepAdaptor_Curve2d(edge, face), BRepAdaptor_Surface(face)
    point, u, v = gp_Pnt(), gp_Vec(), gp_Vec()
    rows = []
    for t in np.linspace(line.FirstParameter(), line.LastParameter(), ON_EDGE).tolist():
        place = line.Value(t)
        surface.D1(place.X(), place.Y(), point, u, v)
        rows.append(np.cross((u.X(), u.Y(), u.Z()), (v.X(), v.Y(), v.Z())))
    normals = np.array(rows)
    lengths = np.linalg.norm(normals, axis=1)
    normals[lengths < POLE * lengths.max()] = np.nan  # where the face has shrunk to a point
    return (-1.0 if face.Orientation() == TopAbs_REVERSED else 1.0) * _unit(normals)


def _unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore", divide="ignore"):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def corners_of(ends: np.ndarray, ways: np.ndarray, tolerance: float) -> np.ndarray:
    """Return where edges that end in points (n, 3) and leave them along (n, 3) meet, other than smoothly two by two."""
    if not len(ends):
        return ends
    _, first, group = np.unique(np.round(ends / tolerance), axis=0, return_index=True, return_inverse=True)
    found = []
    for number, rows in by_value(group.ravel()):
        straight = len(rows) == 2 and ways[rows[0]] @ ways[rows[1]] < -np.cos(np.radians(SHARP))
        if not straight:
            found.append(ends[first[number]])
    return np.array(found).reshape(-1, 3)
