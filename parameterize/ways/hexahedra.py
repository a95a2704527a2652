"""The way to hexahedra of tetrahedra, which serves every part: its edges stay sharp, and every patch is proved."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..certificate.boundary import check_boundary
from ..layouts.tetrahedra.curving import CurvedMesh, pulled_back
from ..layouts.tetrahedra.from_triangles import tetrahedra_of_surface
from ..layouts.tetrahedra.hexahedra import PARTS, spline_of_tetrahedra
from ..layouts.tetrahedra.mesh import TetrahedralMesh
from ..layouts.tetrahedra.mesher import MesherError, Sizes, tetrahedra_of_brep
from ..layouts.tetrahedra.part_mesh import curved_tetrahedra
from ..optimization.endings import Reason
from ..spline.spline_map import SplineMap
from ..surface.surface import Surface
from ..threads import one_blas_thread
from .laid import Laid
from .mapping_task import MappingTask
from .sharp import has_long_edges
from .tried import Tried
from .way import Attempt, Suits, Way

_SHARES = (0.97, 0.9, 0.75)  # of their displacements that tetrahedra keep which are not proved to be apart, one by one
_FEW = 200  # of them: more are no cusps
FAR = 2e-3  # root mean square distance at volume 1 of a map, above which hexahedra follow it


@dataclass(frozen=True)
class HexahedraOfTetrahedra(Laid):
    """Make a map of the four hexahedra of each tetrahedron of a coarse mesh, curved onto the part.

    is_last: whether it comes after all other ways, for bodies with sharp edges of which these make no good map.
    """

    is_last: bool = False

    origin, why = "hexahedra", Reason.CURVED
    comes_from = "hexahedra of tetrahedra", "curved onto the faces of the part"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body is a part, or other ways have failed, and a mesher divides it."""
        crosses = not task.surface.brep and len(task.surface.crossings) > 0  # triangles of exact faces may cross
        if task.given_corners is not None or task.config.blocks is not None or crosses:
            return Suits(False)
        if not (has_long_edges(task.surface) if self.is_last else is_part(task.surface)):
            return Suits(False)
        found = _tetrahedra(task)
        if not isinstance(found, CurvedMesh):
            return Suits(False, found)
        off = found.farthest / _diagonal(task)
        what = f"{PARTS * len(found.mesh.cells)} hexahedra of tetrahedra"
        return Suits(True, f"{what}, with nodes within {off:.1e} of the part (over diagonal)")

    def lay(self, task: MappingTask) -> SplineMap:
        """Return the map of the hexahedra at volume 1."""
        found = _tetrahedra(task)
        assert isinstance(found, CurvedMesh), "the way suits the body"
        spline = _apart(found, task.config.spline.degree, task.surface.solids)
        return spline.with_control(np.ascontiguousarray(task.surface.to_unit(spline.control.T).T))

    def serves(self, attempt: Attempt) -> bool:
        """Return whether the map has no faults: proved hexahedra may still meet each other where walls are thin."""
        return Way.serves(self, attempt)

    def follows(self, tried: Sequence[Tried]) -> bool:
        """Return whether no map that was tried is good enough and near the surface."""
        return all(not one.serves or one.attempt is None or one.attempt.distance > FAR for one in tried)


HEXAHEDRA = HexahedraOfTetrahedra("hexahedra", "curving the hexahedra of tetrahedra onto the part")
LAST_HEXAHEDRA = HexahedraOfTetrahedra("last hexahedra", "curving hexahedra onto the surface", is_last=True)


def is_part(surface: Surface) -> bool:
    """Return whether a body has exact faces, cavities or several solids, or handles and long sharp edges."""
    if surface.brep or not surface.is_plain:
        return True
    return surface.genus > 0 and has_long_edges(surface)


def _apart(found: CurvedMesh, degree: int, names: tuple[str, ...]) -> SplineMap:
    """Return the map whose boundary is proved not to meet itself, if a few tetrahedra need to step back for it.

    Two edges of a part that meet at no angle leave no room for a proof.
    """
    spline = spline_of_tetrahedra(found, degree, names)
    for share in _SHARES:
        left = np.unique(np.array(check_boundary(spline.body).undecided_patches, dtype=np.int64) // PARTS)
        if not 0 < len(left) <= _FEW:
            break
        found = pulled_back(found, left, share)
        spline = spline_of_tetrahedra(found, degree, names)
    return spline


def _diagonal(task: MappingTask) -> float:
    """Return the diagonal of the surface's box in the user's units."""
    low, high = task.surface.bbox
    return float(np.linalg.norm(high - low))


def _tetrahedra(task: MappingTask) -> CurvedMesh | str:
    """Return the curved tetrahedra of a body in the user's units, or why there are none."""
    surface = task.surface

    def mesher(sizes: Sizes) -> TetrahedralMesh:
        return tetrahedra_of_brep(surface.brep, sizes) if surface.brep else tetrahedra_of_surface(surface, sizes)

    def find() -> CurvedMesh | str:
        try:
            with one_blas_thread():
                return curved_tetrahedra(mesher, _diagonal(task))
        except MesherError as error:
            return str(error)

    return task.fact("tetrahedra", find)
