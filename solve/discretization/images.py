"""Finds the nearest points of faces: where the images of the points of one region lie on another region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from parameterize.arrays import Array, IntArray
from parameterize.spline.interface import axis_side
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.spline_stack import VALUE
from parameterize.spline.volume import UNITS, BSplineVolume

from .surface_rule import Faces
from .weak import WeakFace

CANDIDATES = 8  # samples of the faces from whose faces the search starts
STEPS = 25  # of Gauss-Newton, at most
SETTLED = 1e-14  # change of a parameter at which a search ends


@dataclass(frozen=True, eq=False)
class Located:
    """Hold points on patches: their patches (m,) and parameters (m, 3)."""

    patches: IntArray
    parameters: Array

    def __len__(self) -> int:
        return len(self.patches)


def nearest_on(
    faces: Sequence[WeakFace], masks: Sequence[Array], volumes: Sequence[BSplineVolume], points: Array
) -> tuple[Located, Array]:
    """Return the nearest points of faces to points (3, m), and the distances (m,).

    masks: which points (m,) of each of the faces belong to the region; the search starts from those. volumes: of all
    patches.
    """
    each = [(face, np.flatnonzero(mask), _faces(face, volumes)) for face, mask in zip(faces, masks, strict=True)]
    samples = np.concatenate([np.asarray(face.x)[:, rows] for face, rows, _ in each], axis=1).T
    of_face = np.concatenate([np.full(len(rows), number) for number, (_, rows, _) in enumerate(each)])
    owners = np.concatenate([face.owners[rows] for face, rows, _ in each])
    places = np.concatenate([face.places[rows] for face, rows, _ in each])
    wanted, count = np.ascontiguousarray(points.T), min(CANDIDATES, len(samples))
    nearest = np.asarray(cKDTree(samples).query(wanted, count)[1]).reshape(len(wanted), count)
    best = np.full(len(wanted), np.inf)
    patches, parameters = np.zeros(len(wanted), dtype=np.int64), np.zeros((len(wanted), 3))
    keys = of_face * (owners.max() + 1) + owners
    for rank in range(count):
        start = nearest[:, rank]
        is_new = (keys[nearest[:, :rank]] != keys[start][:, None]).all(axis=1)
        for number, (face, _, on) in enumerate(each):
            rows = np.flatnonzero(is_new & (of_face[start] == number))
            if not len(rows):
                continue
            own = owners[start[rows]]
            found, distance = _projected(on, own, places[start[rows]], wanted[rows])
            closer = distance < best[rows]
            chosen = rows[closer]
            best[chosen], parameters[chosen] = distance[closer], found[closer]
            patches[chosen] = face.patches[own[closer]]
    return Located(patches, parameters), best


def _faces(face: WeakFace, volumes: Sequence[BSplineVolume]) -> Faces:
    (group,) = groups_of([volumes[number] for number in face.patches])
    return Faces.of(group, *axis_side(face.name))


def _projected(faces: Faces, owners: IntArray, start: Array, points: Array) -> tuple[Array, Array]:
    """Return parameters (m, 3) of the nearest points of faces `owners` (m,) to points (m, 3), and distances (m,).

    Gauss-Newton's method with parameters that stay in the face: one at its end is left there if the step leads out.
    """
    along = [a for a in range(3) if a != faces.axis]
    t, active = start[:, along].copy(), np.arange(len(points))
    for _ in range(STEPS):
        own = owners[active]
        x, first, second = faces.surface.derivatives_at(
            own, faces.parameters(t[active]), (VALUE, UNITS[along[0]], UNITS[along[1]])
        )
        rest = points[active] - x
        slopes = np.stack([first, second], axis=-1)  # (m, 3, 2)
        pull = np.einsum("mxi,mx->mi", slopes, rest)
        stays = (t[active] <= 0.0) & (pull < 0.0) | (t[active] >= 1.0) & (pull > 0.0)
        slopes = np.where(stays[:, None], 0.0, slopes)
        gram = np.einsum("mxi,mxj->mij", slopes, slopes) + np.eye(2) * stays[:, :, None]
        step = np.linalg.solve(gram, np.where(stays, 0.0, pull)[..., None])[..., 0]
        moved = np.clip(t[active] + step, 0.0, 1.0)
        change = np.abs(moved - t[active]).max(axis=1)
        t[active] = moved
        active = active[change > SETTLED]
        if not len(active):
            break
    parameters = faces.parameters(t)
    return parameters, np.linalg.norm(faces.surface.at(owners, parameters) - points, axis=1)
