"""The final boundary map: every surface point's place on the cube, one-to-one, cut along the cube's edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Array, IntArray
from ..config import LAYOUT
from ..spline.volume import BSplineVolume
from .boundary_map import BoundaryMap
from .closest_point import damped_fit
from .cube import snap
from .cutting import CutMesh, cut_along_rays
from .flips import untangle


def boundary_map(volume: BSplineVolume, vertices: Array, faces: IntArray, parameters: Array) -> BoundaryMap:
    """Cut the surface (vertices (n, 3), user's units) where its parameters (n, 3) pass an edge of the cube.

    Parameters come from closest points of the volume's boundary, which may turn a few triangles over where the spline
    smooths a detail away; those are laid out anew first. Cut vertices follow the input's vertices.
    """
    placed = untangle(parameters, faces)
    for number in range(LAYOUT.nudges):
        cut = cut_along_rays(placed, faces, LAYOUT.same)
        spread = snap(cut.carry(placed))
        spread[: len(placed)] = placed
        plain = BoundaryMap(cut.carry(vertices), spread, cut.faces)
        turned = plain.flipped()
        if not len(turned):
            break
        placed = _nudged(placed, cut, turned, number)
    closer = _settle_cuts(volume, vertices, cut, plain.parameters)
    return plain if len(closer.flipped()) > len(plain.flipped()) else closer


def _nudged(placed: Array, cut: CutMesh, turned: IntArray, number: int) -> Array:
    """Shift the vertices (n, 3) around degenerate pieces a little: a mesh edge ran through a corner of the cube."""
    corners = np.unique(cut.faces[turned])
    around = np.unique(np.concatenate([corners[corners < len(placed)], cut.parents[corners].ravel()]))
    around = around[around < len(placed)]
    moved = placed.copy()
    moved[around] += LAYOUT.nudge * np.random.default_rng(number).uniform(-1.0, 1.0, (len(around), 3))
    return snap(moved)


def _settle_cuts(volume: BSplineVolume, vertices: Array, cut: CutMesh, parameters: Array) -> BoundaryMap:
    """Move each cut vertex along its mesh edge and its parameter along the cube's edge until F(p) is close to it."""
    best = BoundaryMap(cut.carry(vertices), parameters, cut.faces)
    for _ in range(LAYOUT.settle_steps):
        share, moved = _settled_once(volume, cut, best, len(vertices))
        cut, best = _without_flips(vertices, cut, best, share, moved)
    return best


def _settled_once(volume: BSplineVolume, cut: CutMesh, best: BoundaryMap, count: int) -> tuple[Array, Array]:
    """Return shares (n,) and parameters (n, 3) after a Gauss-Newton step in these two unknowns of each cut vertex.

    The first `count` vertices are those of the input. Corners of the cube and cuts within a face keep their parameter.
    """
    where, new = best.parameters[count:], best.vertices[count:]
    inner = (where > 0.0) & (where < 1.0)  # (k, 3)
    inner &= inner.sum(axis=1, keepdims=True) == 1  # the cube edge's direction; ends of cuts within a face stay
    start, end = best.vertices[cut.parents[count:].T]
    along_cube = np.einsum("kab,kb->ka", volume.jacobian(where), inner.astype(float))
    shift, slide = damped_fit(end - start, -along_cube, volume(where) - new, LAYOUT.settle_damping)
    share, moved = cut.share.copy(), best.parameters.copy()
    margin = LAYOUT.settle_margin
    share[count:] = np.clip(share[count:] + shift, margin, 1.0 - margin)
    moved[count:] = np.where(inner, np.clip(where + slide[:, None], margin**2, 1.0 - margin**2), where)
    return share, moved


def _without_flips(
    vertices: Array, cut: CutMesh, best: BoundaryMap, share: Array, moved: Array
) -> tuple[CutMesh, BoundaryMap]:
    """Undo the steps to `share` and `moved` at flipped triangles; return the old cuts and map if some stay flipped."""
    for _ in range(LAYOUT.undo_rounds):
        trial = replace(cut, share=share)
        candidate = BoundaryMap(trial.carry(vertices), moved, cut.faces)
        turned = np.setdiff1d(cut.faces[candidate.flipped()].ravel(), np.arange(len(vertices)))
        if not turned.size:
            return trial, candidate
        share[turned], moved[turned] = cut.share[turned], best.parameters[turned]
    return cut, best
