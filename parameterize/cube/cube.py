"""Describes the unit cube: its corners, edges and faces, projections onto its boundary, and steps on its faces.

A face has the number 2 * axis + side: `axis` is the parameter that is constant on it, and `side` its value there. In
the order of their numbers the faces are called u0, u1, v0, v1, w0, w1.
"""

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from ..arrays import Array, IntArray

CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64)  # (8, 3), (0,0,0), (0,0,1), ..., (1,1,1)
EDGES = [(i, j) for i in range(8) for j in range(i + 1, 8) if np.abs(CORNERS[i] - CORNERS[j]).sum() == 1.0]
VARYING_AXES = np.array([[1, 2], [0, 2], [0, 1]])  # the axes that vary where the given one is constant, ascending
NEAR_EDGE = 1e-5  # places closer than this to an edge of the cube are put on it, so that later cuts leave no slivers


def face_number(axis: Any, side: Any) -> Any:
    """Return the numbers of the faces where the parameter `axis` is constant, 0 (side 0) or 1 (side 1)."""
    return 2 * axis + side


def axis_and_side(faces: Any) -> tuple[Any, Any]:
    """Return the constant axis and the side, 0 or 1, of face numbers, which are integers, arrays or tensors.

    A face of a body of blocks has the number 6 * block + face.
    """
    return faces % 6 // 2, faces % 2


def tangent_axes(axis: Any) -> tuple[Any, Any]:
    """Return the axes a and b within faces of constant `axis`, such that (a, b, axis) is right-handed."""
    return (axis + 1) % 3, (axis + 2) % 3


def nearest_faces(places: Array) -> IntArray:
    """Return the numbers (n,) of the cube faces nearest to places (n, 3); on an edge, of one of the two faces."""
    centred = places - 0.5
    axis = np.abs(centred).argmax(axis=1)
    return np.asarray(face_number(axis, centred[np.arange(len(axis)), axis] > 0.0))


def project_radially(centred: Array) -> Array:
    """Return points (n, 3) projected onto the cube's boundary along rays from its centre; the centre is the origin."""
    return np.asarray(centred / (2.0 * np.abs(centred).max(axis=1, keepdims=True)))


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def snap(parameters: Array) -> Array:
    """Return parameters (n, 3) projected radially onto the cube, and onto edges and corners within NEAR_EDGE."""
    found = np.empty_like(parameters)
    for n in range(len(parameters)):
        x, y, z = parameters[n, 0] - 0.5, parameters[n, 1] - 0.5, parameters[n, 2] - 0.5
        width = 2.0 * max(abs(x), abs(y), abs(z))
        for c, centred in enumerate((x, y, z)):
            projected = centred / width
            is_at_side = abs(projected) >= 0.5 - NEAR_EDGE
            found[n, c] = 0.5 + (math.copysign(0.5, projected) if is_at_side else projected)
    return found


def damped_fit(first: Array, second: Array, right: Array, damping: float) -> tuple[Array, Array]:
    """Return the coefficients a, b (k,) that minimise |a first + b second - right|, for vectors (k, 3).

    Every Gauss-Newton step on a face towards a closest point solves this linear system. The diagonal of the normal
    equations grows by `damping` times its sum, because the two directions may be parallel. The vectors are first scaled
    by a power of two, exactly, so that nothing overflows in any unit.
    """
    exponent = -int(np.frexp(max(np.abs(first).max(initial=0.0), np.abs(second).max(initial=0.0)))[1])
    first, second, right = (np.ldexp(vectors, exponent) for vectors in (first, second, right))
    aa, bb, ab = (first * first).sum(1), (second * second).sum(1), (first * second).sum(1)
    ra, rb = (first * right).sum(1), (second * right).sum(1)
    a, b = damped_solution(aa, bb, ab, ra, rb, damping)
    return np.asarray(a), np.asarray(b)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def damped_solution(aa: Any, bb: Any, ab: Any, ra: Any, rb: Any, damping: float) -> tuple[Any, Any]:
    """Return the coefficients of `damped_fit` from the inner products of its two vectors and the right side."""
    lift = damping * (aa + bb) + 1e-150  # the last term keeps the determinant of two zero vectors positive
    aa, bb = aa + lift, bb + lift
    determinant = aa * bb - ab * ab
    return (bb * ra - ab * rb) / determinant, (aa * rb - ab * ra) / determinant


@dataclass(frozen=True, eq=False)
class CubeLayout:
    """Hold a closed surface and its layout on the boundary of the cube, vertex by vertex.

    points: (n, 3), on the surface; the mesh's own vertices come first, the vertices of cut edges follow.

    faces: (m, 3), the triangles between the points, outward.

    places: (n, 3), the points' places on the boundary of the cube, or near it as long as the layout has to be
    untangled. In the layout on the sphere (sphere.py, turning.py) the places are unit vectors from the origin.

    n_own: the number of the mesh's own vertices.
    """

    points: Array
    faces: IntArray
    places: Array
    n_own: int
