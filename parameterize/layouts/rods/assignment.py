"""Which face of a junction's cube each branch leaves through, and how the cube is turned."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from ...arrays import Array, IntArray

NORMALS = np.array([sign * np.eye(3)[axis] for axis in range(3) for sign in (-1.0, 1.0)])  # of u0, u1, v0, v1, w0, w1
MOST = len(NORMALS)  # branches at one junction


@dataclass(frozen=True, eq=False)
class Assignment:
    """The faces of a cube through which branches leave it.

    Attributes
    ----------
    faces : (d,) array of int
        The number of the face of each branch, in the order u0, u1, v0, v1, w0, w1.
    axes : (3, 3) array
        The directions of u, v and w in space, one a row: orthonormal and right-handed.
    angles : (d,) array
        Between each branch and the outward normal of its face, in radians.
    """

    faces: IntArray
    axes: Array
    angles: Array


def assigned(directions: Array) -> Assignment:
    """Return the assignment whose squared angles have the least sum, for unit vectors (d, 3), 2 <= d <= 6.

    Every assignment is tried, the first branch at u0, since turns of the cube are free; its best turn is that of
    Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32 (1976).
    """
    rest = permutations(range(1, MOST), len(directions) - 1)
    faces = np.array([(0, *others) for others in rest])  # (k, d)
    left, _, right = np.linalg.svd(np.einsum("kda,db->kab", NORMALS[faces], directions))
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    axes = left @ right  # (k, 3, 3): row a is the direction of parameter a
    cosines = np.einsum("kda,kab,db->kd", NORMALS[faces], axes, directions)
    angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    best = int(np.argmin((angles**2).sum(axis=1).round(9)))
    return Assignment(faces[best], axes[best], angles[best])
