"""Surface: the closed surface of a body, checked and repaired, or a MeshError that says why it is refused."""

import hashlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, IntArray
from ..display import Brief, Shown
from . import topology
from .bodies import Choice, outer_bodies
from .brep import kept_brep
from .errors import (
    MeshError,
    check_finite,
    check_indices,
    without_unused_defects,
)
from .features import SHARP, Features, features_of
from .geometry import signed_volume
from .gluing import NO_WALLS, Walls
from .groups import Groups, checked, of_solids, renumbered
from .holes import Close
from .mending import Asked, mend, without_defects
from .part import PartSurface
from .readers.file import RawMesh, read_mesh
from .readers.objects import READERS, class_of, read_object
from .shells import components
from .solid import Solid
from .solids import distinct_solids, solids_of

if TYPE_CHECKING:
    import meshio
    import pyvista
    import trimesh

__all__ = ["MAX_FACES", "MeshError", "Surface", "load_surface", "surface_from_arrays"]

MAX_FACES = 500_000
logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class Surface(Brief, Shown):
    """The closed surface of a body, wound outward, with its placement in the unit cube's space.

    It has several components where the body has cavities, whose walls are wound out of the body, or several solids.

    `load_surface`, `surface_from_arrays` and `sample` make surfaces.

    Attributes
    ----------
    name : str
        The input's stem.
    vertices : (n, 3) array
        In the user's units.
    faces : (m, 3) array of int
        Vertex numbers of the triangles.
    source : str
        The path as given, "" for arrays.
    sha256 : str
        Of the file's bytes, or of the arrays.
    notices : tuple of str
        Repairs and doubts, one line each.
    scale : float
    center : (3,) array
        to_unit(x) = scale * (x - center) + 1/2 gives volume 1 and puts the deepest interior point at (1/2, 1/2, 1/2).
    unit_vertices : (n, 3) array
        The vertices, so placed and rounded to single precision, in which networks train: the same surface in another
        unit or at another place then has the same numbers, and so the same map.
    crossings : (k, 2) array of int
        Pairs of faces that intersect.
    groups : dict of str to array of int
        The faces of each group of the input, ascending: OBJ groups, materials and objects, STL solids, physical groups
        of Gmsh, whole numbers given with faces; and the outer faces of each of several solids, by its name, or
        "solid2". A face may be in several.
    unit : str
        Of lengths, where the file has one, such as mm.
    sharp : float
        The angle in degrees between the normals of two triangles above which their edge is sharp, 40 by default.
    brep : bytes
        Of a solid model the exact faces, as a text in the BREP format of OpenCASCADE 7, in the user's units; empty
        where there is none, or where repairs have changed the shape.
    brep_faces : (m,) array of int
        The face of each triangle, in the order of `brep`, counted from 1; 0 for a triangle of none.
    solids : tuple of str
        The names of the solids, in the order of `brep`; "" for one without a name.
    owners : (m,) array of int
        The solid of each triangle, counted from 0.
    walls : Walls
        The triangles between solids that touch, which are not among `faces`: `corners` (k, 3, 3) in the user's units,
        and `solids` (k, 2), the two solids of each.
    shapes : dict of str to str
        The shapes of some groups of a solid model in words, such as "plane through (0, 2, 3), normal (-1, 0, 0)".

    Examples
    --------
    >>> import iga_nn
    >>> cube = iga_nn.sample("cube")
    >>> round(cube.volume, 12), [corner.tolist() for corner in cube.bbox]
    (1.0, [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    >>> cube.to_unit(cube.center)
    array([0.5, 0.5, 0.5])
    """

    name: str
    vertices: Array
    faces: IntArray
    source: str
    sha256: str
    notices: tuple[str, ...]
    scale: float
    center: Array
    unit_vertices: Array
    crossings: IntArray
    groups: Groups
    unit: str = ""
    sharp: float = SHARP
    brep: bytes = field(default=b"", repr=False)
    brep_faces: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    solids: tuple[str, ...] = ("",)
    owners: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    walls: Walls = NO_WALLS
    shapes: Mapping[str, str] = field(default_factory=dict)

    def to_unit(self, points: ArrayLike) -> Array:
        """Return points (..., 3) in the user's units as placed points."""
        return self.scale * (np.asarray(points, dtype=np.float64) - self.center) + 0.5

    def from_unit(self, points: ArrayLike) -> Array:
        """Return placed points (..., 3) in the user's units."""
        return (np.asarray(points, dtype=np.float64) - 0.5) / self.scale + self.center

    @property
    def volume(self) -> float:
        """Return the enclosed volume in the user's units."""
        return float(self.scale**-3.0)

    @cached_property
    def shells(self) -> int:
        """Return the number of connected components of the surface."""
        return len(components(self.faces))

    @property
    def is_plain(self) -> bool:
        """Return whether the body is one solid without cavities."""
        return self.shells == len(self.solids) == 1

    @cached_property
    def genus(self) -> int:
        """Return the number of handles, of all shells together."""
        return topology.genus_of(self.faces) + self.shells - 1

    @cached_property
    def features(self) -> Features:
        """Return the sharp edges, those whose triangles meet at more than the angle `sharp`."""
        return features_of(self.vertices, self.faces, self.sharp)

    @property
    def bbox(self) -> tuple[Array, Array]:
        """Return the lowest and the highest corner of the bounding box, (3,) each, in the user's units."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def part(self) -> PartSurface:
        """Return the mesh whose triangles are found by group, by a nearby point, or up to sharp edges."""
        return PartSurface(self.vertices, self.faces, self.groups)

    @cached_property
    def fitted(self) -> "tuple[Surface, str]":
        """Return the surface that maps are laid out and fitted on, and a notice; itself, and "", unless it is large."""
        from .decimation import fitted_copy

        return fitted_copy(self)

    def summary(self) -> dict[str, Any]:
        """Return the section `input` of report.json."""
        first = self.crossings[: topology.SHOWN]
        places = topology.crossing_places(self.vertices, self.faces, first)
        several = len(self.solids) > 1
        return {
            "file": self.source or self.name,
            "sha256": self.sha256,
            "vertices": len(self.vertices),
            "faces": len(self.faces),
            "volume": self.volume,
            "genus": self.genus,
            **({"shells": self.shells} if self.shells > 1 else {}),
            **({"solids": [name or f"solid{k}" for k, name in enumerate(self.solids, 1)]} if several else {}),
            "bbox": [corner.tolist() for corner in self.bbox],
            **({"unit": self.unit} if self.unit else {}),
            "self_intersections": {
                "pairs": len(self.crossings),
                "first": [
                    {"faces": pair, "near": place} for pair, place in zip(first.tolist(), places.tolist(), strict=True)
                ],
            },
            "sharp_edges": {
                "edges": len(self.features),
                "corners": len(self.features.corners),
                "length": float(self.features.lengths.sum()),
            },
            "groups": [
                {"name": name, "faces": len(numbers), "area": self.part.area(numbers)}
                | ({"shape": self.shapes[name]} if name in self.shapes else {})
                for name, numbers in self.groups.items()
            ],
            "notices": list(self.notices),
        }

    def refuse_crossings(self) -> None:
        """Raise MeshError where faces intersect."""
        if len(self.crossings):
            found = topology.describe_crossings(self.vertices, self.faces, self.crossings)
            name = self.source or self.name
            raise MeshError(f"{name}: {found}: pull the sheets apart there, or check without --strict")


def load_surface(
    mesh: "str | Path | trimesh.Trimesh | pyvista.PolyData | meshio.Mesh",
    *,
    component: Choice = None,
    close: Close = False,
    deflection: float | None = None,
    max_faces: int = MAX_FACES,
) -> Surface:
    """Return the surface of a file or of a mesh of trimesh, pyvista or meshio, checked and repaired.

    Parameters
    ----------
    mesh : str or Path, or a trimesh.Trimesh, pyvista.PolyData or meshio.Mesh
        The path of a surface (.obj, .stl, .ply, .off, .glb, .gltf, .3mf, .vtp), of cells (.mesh, .msh, .vtu, .vtk) or
        of a solid model (.step, .iges), each also as .gz or .zip, or a mesh in memory. Of solid
        cells the boundary is taken.
    component : int or "largest", optional
        The component to take where there are several: 0 has most faces, "largest" encloses most volume.
    close : bool or "all"
        Fill holes by smooth patches; "all" also those longer than a quarter of the box's diagonal, or of more than 5 %
        of the area.
    deflection : float, optional
        Of a solid model: largest distance of the triangles from curved faces, in the file's unit; a thousandth of the
        box's diagonal by default.
    max_faces : int
        A surface with more faces is refused.

    Returns
    -------
    Surface
        Checked and repaired; its `notices` list the repairs.

    Raises
    ------
    MeshError
        A ValueError of one line, for a file that cannot be read or a surface that is not closed.
    TypeError
        For an object of another class.

    Examples
    --------
    >>> import iga_nn
    >>> from iga_nn.samples import write_obj
    >>> write_obj(iga_nn.sample("ellipsoid"), "ellipsoid.obj")
    >>> iga_nn.load_surface("ellipsoid.obj").faces.shape
    (4996, 3)

    >>> import trimesh
    >>> iga_nn.load_surface(trimesh.creation.icosphere()).vertices.shape
    (642, 3)
    """
    kind = class_of(mesh)
    if kind is None and not isinstance(mesh, (str, Path)):
        known = ", ".join(READERS)
        raise TypeError(f"mesh must be a path or one of {known}, got {mesh!r:.80}; for arrays: surface_from_arrays")
    source = kind or str(mesh)
    asked = Asked(component, close, max_faces)
    try:
        if kind is not None:
            surface = _gate(read_object(mesh, kind, max_faces), "surface", "", asked)
        else:
            path = Path(source)
            name = path.name.split(".")[0] or path.name
            surface = _gate(read_mesh(path, max_faces, deflection), name, source, asked)
    except MeshError as error:
        raise MeshError(f"{source}: {error}") from None
    logger.debug("%s: %d vertices, %d faces", source, len(surface.vertices), len(surface.faces))
    return surface


def bodies_in(path: Path, max_faces: int = MAX_FACES) -> list[int | None]:
    """Return the numbers of the components of a file that are bodies of their own, as `component` of `load_surface`.

    One inside another is none. None alone stands for all of the file. Raises MeshError for a file that is refused.
    """
    raw = read_mesh(path, max_faces)
    if (count := len(distinct_solids(raw))) > 1:
        return list(range(count))
    return outer_bodies(without_defects(solids_of(raw, None)[0], max_faces)[0])


def surface_from_arrays(
    vertices: ArrayLike,
    faces: ArrayLike,
    name: str = "surface",
    *,
    component: Choice = None,
    close: Close = False,
    max_faces: int = MAX_FACES,
    groups: Mapping[str, ArrayLike] | None = None,
) -> Surface:
    """Make a surface of arrays, with the checks of `load_surface`.

    Parameters
    ----------
    vertices : (n, 3) array
        In any unit.
    faces : (m, 3) array of int
        Vertex numbers of the triangles, counted from 0.
    name : str
        The surface's name in messages and files.
    component : int or "largest", optional
        The component to take where there are several: 0 has most faces, "largest" encloses most volume.
    close : bool or "all"
        Fill holes by smooth patches; "all" also those longer than a quarter of the box's diagonal, or of more than 5 %
        of the area.
    max_faces : int
        A surface with more faces is refused.
    groups : dict of str to array of int, optional
        Numbers of the faces of each group, counted from 0.

    Raises
    ------
    MeshError
        A ValueError that names the defect of the arrays or the surface.

    Examples
    --------
    >>> from parameterize import surface_from_arrays
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> tetrahedron = surface_from_arrays(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> round(6 * tetrahedron.volume, 12)
    1.0
    """
    try:
        points, triangles = _array(vertices, "vertices"), _array(faces, "faces")
        if points.dtype.kind not in "iuf":
            raise MeshError(f"vertices must be real numbers, got {points.dtype}")
        points = np.array(points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise MeshError(f"vertices must have shape (n, 3), got {points.shape}")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
            raise MeshError(f"faces must be integers of shape (m, 3), got {triangles.dtype} of shape {triangles.shape}")
        triangles = triangles.astype(np.int64)
        digest = hashlib.sha256(points.tobytes() + triangles.tobytes()).hexdigest()
        check_indices(points, triangles)
        check_finite(points, triangles)
        points, notices = without_unused_defects(points, triangles)
        named = checked(groups or {}, len(triangles))
        raw = RawMesh(points, triangles, digest, notices, named)
        return _gate(raw, name, "", Asked(component, close, max_faces))
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from None


def _array(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return values as an array. Raises MeshError where their rows have several lengths."""
    try:
        return np.asarray(values)
    except ValueError:
        raise MeshError(f"{name} must be rows of three, got rows of several lengths") from None


def _gate(raw: RawMesh, name: str, source: str, asked: Asked) -> Surface:
    """Make a surface: mend it, check its topology, place it."""
    raw, component = solids_of(raw, asked.component)
    solids, mended = mend(raw, replace(asked, component=component))
    repaired = solids.mesh
    points, triangles = repaired.points, repaired.faces
    doubts = [] if raw.brep else topology.slivers(points, triangles, repaired.where)  # those of a reader are no fault
    crossings = solids.crossings
    if len(crossings):
        doubts.append(topology.describe_crossings(repaired.vertices, triangles, crossings))
    deepest, _ = Solid(points, triangles).deepest()
    unit_scale = signed_volume(points, triangles) ** (-1.0 / 3.0)
    placed = unit_scale * (points - deepest) + 0.5
    exact = kept_brep(raw, solids.old)
    return Surface(
        name=name,
        vertices=repaired.vertices,
        faces=triangles,
        source=source,
        sha256=raw.sha256,
        notices=(*mended, *doubts),
        scale=unit_scale / repaired.size,
        center=deepest * repaired.size + repaired.middle,
        unit_vertices=placed.astype(np.float32).astype(np.float64),
        crossings=crossings,
        groups=of_solids(solids.names, solids.owners) | renumbered(raw.groups, repaired.old),
        unit=raw.unit,
        brep=exact.text,
        brep_faces=exact.faces[: len(triangles)],
        solids=solids.names,
        owners=solids.owners,
        walls=solids.walls,
        shapes=raw.shapes,
    )
