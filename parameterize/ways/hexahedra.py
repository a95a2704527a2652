"""The way to hexahedra of tetrahedra, which serves every part: its edges stay sharp, and every patch is proved."""

import numpy as np

from ..layouts.tetrahedra.curving import CurvedMesh
from ..layouts.tetrahedra.from_triangles import tetrahedra_of_surface
from ..layouts.tetrahedra.hexahedra import PARTS, spline_of_tetrahedra
from ..layouts.tetrahedra.mesh import TetrahedralMesh
from ..layouts.tetrahedra.mesher import MesherError, Sizes, tetrahedra_of_brep
from ..layouts.tetrahedra.part_mesh import curved_tetrahedra
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from ..threads import one_blas_thread
from .laid import Laid, in_words
from .mapping_task import MappingTask
from .sharp import FEW_EDGES, PIECE
from .way import Attempt, Suits, Way


class HexahedraOfTetrahedra(Laid):
    """Make a map of the four hexahedra of each tetrahedron of a coarse mesh, curved onto the part."""

    origin, why = "hexahedra", Reason.CURVED
    comes_from = "hexahedra of tetrahedra", "curved onto the faces of the part"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body is a part whose sharp edges no other way keeps, and a mesher divides it."""
        found = _tetrahedra(task)
        if not isinstance(found, CurvedMesh):
            return Suits(False, found)
        hexahedra = in_words(PARTS * len(found.mesh.cells), "hexahedron").replace("hexahedrons", "hexahedra")
        off = found.farthest / _diagonal(task)
        faces = "exact faces" if task.surface.brep else "smooth faces"
        return Suits(True, f"a part with {faces}: {hexahedra}, nodes within {off:.1e} of them (over diagonal)")

    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map of the hexahedra at volume 1."""
        found = _tetrahedra(task)
        assert isinstance(found, CurvedMesh), "the way suits the body"
        spline = spline_of_tetrahedra(found, task.config.spline.degree, task.surface.solids)
        return spline.with_control(np.ascontiguousarray(task.surface.to_unit(spline.control.T).T))

    def serves(self, attempt: Attempt) -> bool:
        """Return whether the map has no faults: proved hexahedra may still meet each other where walls are thin."""
        return Way.serves(self, attempt)


HEXAHEDRA = HexahedraOfTetrahedra("hexahedra", "curving the hexahedra of tetrahedra onto the part")


def _diagonal(task: MappingTask) -> float:
    """Return the diagonal of the surface's box in the user's units."""
    low, high = task.surface.bbox
    return float(np.linalg.norm(high - low))


def _tetrahedra(task: MappingTask) -> CurvedMesh | str:
    """Return the curved tetrahedra of a part in the user's units; why there are none, "" for a body that is no part."""
    surface, most = task.surface, task.config.blocks
    if task.given_corners is not None or most is not None or not (surface.brep or _is_part(task)):
        return ""

    def mesher(sizes: Sizes) -> TetrahedralMesh:
        return tetrahedra_of_brep(surface.brep, sizes) if surface.brep else tetrahedra_of_surface(surface, sizes)

    def find() -> CurvedMesh | str:
        try:
            with one_blas_thread():
                return curved_tetrahedra(mesher, _diagonal(task))
        except MesherError as error:
            return str(error)

    return task.fact("tetrahedra", find)


def _is_part(task: MappingTask) -> bool:
    """Return whether a surface without exact faces has cavities, several solids, or handles and long sharp edges."""
    surface = task.surface
    lengths = surface.features.lengths * surface.scale
    return not surface.is_plain or bool(surface.genus and lengths[lengths > PIECE].sum() >= FEW_EDGES)
