"""The boundary of a saved volume, evaluated by scipy's splines: points, fine triangles, sharp edges and corners."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

import iga_nn
from parameterize.spline.body import as_body
from parameterize.spline.interface import face_layer, outward, varying

FLAT = 2e-5  # of the size: how far triangles may be from the faces
MOST_CUTS = 32  # of a span
EDGE_CUTS = 16  # segments of a span of a sharp edge
BENT = 5.0  # degrees between the normals of two faces, from which on an edge between them is sharp


@dataclass(frozen=True, eq=False)
class Faces:
    """Outer faces with the same knots; their two directions and the way out are right-handed.

    nets: (k, n_a, n_b, 4), homogeneous control points.
    """

    degrees: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    nets: np.ndarray

    def at(self, a: np.ndarray, b: np.ndarray, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the points (k, len(a), len(b), 3) at a grid of parameters."""
        along = BSpline(self.knots[0], self.nets[rows].swapaxes(0, 1), self.degrees[0])(a)
        both = BSpline(self.knots[1], along.transpose(2, 1, 0, 3), self.degrees[1])(b)
        points = both.transpose(1, 2, 0, 3)
        return points[..., :3] / points[..., 3:]

    def spans(self, cuts: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the parameters that divide each span of both directions into so many."""
        a, b = (refined(knots, cuts) for knots in self.knots)
        return a, b


def refined(knots: np.ndarray, cuts: int) -> np.ndarray:
    """Return the knots with points between them that divide each span into so many."""
    ends = np.unique(knots)
    return np.append((ends[:-1, None] + np.diff(ends)[:, None] * np.arange(cuts) / cuts).ravel(), ends[-1])


@dataclass(frozen=True, eq=False)
class Boundary:
    """The outer faces of a body by groups."""

    groups: tuple[Faces, ...]

    @classmethod
    def load(cls, path: Path) -> Boundary:
        """Read a volume.npz."""
        body = as_body(iga_nn.load_volume(path))
        nets, basis = defaultdict(list), {}
        for number, face in body.outer_faces:
            patch = body.patches[number]
            weights = np.ones(patch.shape) if patch.weights is None else patch.weights
            net = np.concatenate([patch.control_points * weights[..., None], weights[..., None]], axis=-1)
            layer = face_layer(net, face)
            turned = outward(layer, face)
            axes = varying(face) if turned is layer else varying(face)[::-1]
            degrees, knots = tuple(patch.degrees[k] for k in axes), tuple(patch.knots[k] for k in axes)
            key = (degrees, *(row.tobytes() for row in knots))
            basis[key] = degrees, knots
            nets[key].append(turned)
        return cls(tuple(Faces(*basis[key], np.stack(found)) for key, found in nets.items()))

    @cached_property
    def size(self) -> float:
        """Return the diagonal of the box of the faces' corners."""
        return float(np.linalg.norm(np.ptp(self.corners, axis=0)))

    @cached_property
    def corners(self) -> np.ndarray:
        """Return the corners (n, 3) of the faces, each once a face."""
        ends = np.array([0.0, 1.0])
        return np.concatenate([faces.at(ends, ends).reshape(-1, 3) for faces in self.groups])

    def points(self, each: int) -> np.ndarray:
        """Return the points (n, 3) in the middles of each x each cells of every span of every face."""
        found = []
        for faces in self.groups:
            a, b = faces.spans(2 * each)
            found.append(faces.at(a[1::2], b[1::2]).reshape(-1, 3))
        return np.concatenate(found)

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return points (n, 3), triangles (m, 3), and how far they are from the faces at most, over the size.

        A face's spans are divided until FLAT holds, or into MOST_CUTS.
        """
        points, corners, worst, first = [], [], 0.0, 0
        for faces in self.groups:
            rest, cuts = np.arange(len(faces.nets)), 1
            while len(rest):
                grid = faces.at(*faces.spans(2 * cuts), rest)
                gap = _gaps(grid) / self.size
                done = (gap <= FLAT) | (2 * cuts >= MOST_CUTS)
                worst = max(worst, float(gap[done].max(initial=0.0)) / 4.0)
                points.append(grid[done].reshape(-1, 3))
                corners.append(first + _grid_triangles(int(done.sum()), *grid.shape[1:3]))
                first += len(points[-1])
                rest, cuts = rest[~done], 2 * cuts
        return np.concatenate(points), np.concatenate(corners), worst

    @cached_property
    def sharp_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, 3) and segments (m, 2) of the edges of faces at which the boundary is bent."""
        middles, normals, lines = (np.concatenate(found) for found in zip(*self._sides(), strict=True))
        other = cKDTree(middles).query(middles, k=2)[1]
        other = np.where(other[:, 0] == np.arange(len(middles)), other[:, 1], other[:, 0])
        cosine = np.clip((normals * normals[other]).sum(axis=1), -1.0, 1.0)
        lines = lines[np.degrees(np.arccos(cosine)) > BENT]
        count = np.arange(lines[..., 0].size).reshape(lines.shape[:2])
        return lines.reshape(-1, 3), np.stack([count[:, :-1], count[:, 1:]], axis=-1).reshape(-1, 2)

    def _sides(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield the middle, the face's normal there, and points (k, EDGE_CUTS + 1, 3) of each span of each side."""
        step = 1e-4
        ends = np.array([0.0, step, 1.0 - step, 1.0])
        for faces in self.groups:
            for turned in (False, True):
                row = faces.knots[1 if turned else 0]
                spans = np.unique(row)
                fine = refined(row, EDGE_CUTS)
                middle = 0.5 * (spans[:-1] + spans[1:])
                both = np.concatenate([middle - step / 2, middle + step / 2])
                at = (lambda t, f=faces: f.at(ends, t).swapaxes(1, 2)) if turned else (lambda t, f=faces: f.at(t, ends))
                near, curve = at(both).reshape(len(faces.nets), 2, len(middle), 4, 3), at(fine)
                along = (near[:, 1] - near[:, 0])[:, :, [0, 3]]
                across = (near[:, 0, :, [1, 3]] - near[:, 0, :, [0, 2]]).transpose(1, 2, 0, 3)
                normal = np.cross(across, along) if turned else np.cross(along, across)
                normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
                pieces = np.arange(len(middle))[:, None] * EDGE_CUTS + np.arange(EDGE_CUTS + 1)
                lines = curve[:, :, [0, 3]][:, pieces].transpose(0, 1, 3, 2, 4)
                yield (
                    at(middle)[:, :, [0, 3]].reshape(-1, 3),
                    normal.reshape(-1, 3),
                    lines.reshape(-1, EDGE_CUTS + 1, 3),
                )


def _gaps(grid: np.ndarray) -> np.ndarray:
    """Return how far every second point of grids (k, m, n, 3) is from the middle of its neighbours, at most: (k,)."""
    found = np.zeros(len(grid))
    for turned in (grid, grid.swapaxes(1, 2)):
        middle = turned[:, 1::2] - 0.5 * (turned[:, :-1:2] + turned[:, 2::2])
        found = np.maximum(found, np.linalg.norm(middle, axis=-1).max(axis=(1, 2)))
    return found


def _grid_triangles(count: int, rows: int, columns: int) -> np.ndarray:
    """Return the triangles (m, 3) of so many grids of points."""
    number = np.arange(count * rows * columns).reshape(count, rows, columns)
    a, b, c, d = number[:, :-1, :-1], number[:, 1:, :-1], number[:, 1:, 1:], number[:, :-1, 1:]
    return np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)


def nearest(points: np.ndarray, places: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Return the distances (n,) of points (n, 3) from the nearest of places (m, 3)."""
    return np.asarray(cKDTree(places).query(points)[0])
