"""Whether a point lies inside of elements: those whose control points' box holds it are searched as Bezier patches."""

import numpy as np

from ..arrays import Array, Mask
from ..spline.bspline import open_uniform_knots
from ..spline.location import locate
from ..spline.volume import BSplineVolume
from .kinds import ElementKind
from .mesh import VolumeMesh
from .patches import patch_matrices


def is_inside(mesh: VolumeMesh, local: Array, among: Mask, point: Array) -> int | None:
    """Return the row of an element among some (elements,) that holds a point (3,), None where none does.

    local: (n, 3), the points of the mesh, scaled to magnitude 1 near the origin, as `point` is.
    """
    for block, start in zip(mesh.blocks, mesh.starts, strict=True):
        rows = np.flatnonzero(among[start : start + len(block.nodes)])
        near = rows[_may_hold(block.kind, local[block.nodes[rows]], point)]
        for row in near.tolist():
            patches = patches_of(block.kind, local[block.nodes[row]])
            if locate(patches, point[None])[0][0] >= 0:
                return int(start + row)
    return None


def _may_hold(kind: ElementKind, nodes: Array, point: Array) -> Mask:
    """Return which elements (k, nodes, 3) have a box of control points that holds a point (3,)."""
    matrices = patch_matrices(kind)
    net = np.einsum("cn,knx->kcx", matrices.reshape(-1, matrices.shape[-1]), nodes, optimize=True)
    room = 1e-9 * np.abs(net).max(initial=0.0)
    return np.asarray(((net.min(axis=1) - room <= point) & (point <= net.max(axis=1) + room)).all(axis=1))


def patches_of(kind: ElementKind, nodes: Array) -> tuple[BSplineVolume, ...]:
    """Return an element (nodes, 3) as Bezier patches."""
    nets = np.einsum("pijkn,nx->pijkx", patch_matrices(kind), nodes)
    u, v, w = (open_uniform_knots(p + 1, p) for p in kind.degrees)
    return tuple(BSplineVolume(kind.degrees, (u, v, w), net) for net in nets)
