"""Measure a saved volume against the exact part of its STEP file, without the program that made it; print JSON.

    python examples/benchmarks/part_distances.py bracket.step out/bracket/volume.npz

Points in the middles of 4 x 4 cells of each outer face are projected onto the exact faces, and points on the exact
faces onto triangles of the outer faces. Of sharp edges (more than 20 degrees) and corners of the part, the distance is
that from sharp edges of the volume and from corners of its patches.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import igl
import numpy as np
from brep import Brep
from volume_boundary import Boundary, nearest

MOST = 20_000  # points each way


def measured(part: Brep, boundary: Boundary) -> dict[str, Any]:
    """Return the largest distances, over the diagonal of the part's box, and what they are of."""
    rng, size = np.random.default_rng(0), part.diagonal
    there = part.distances(chosen(part, boundary.points(4), rng))
    points, triangles, fineness = boundary.triangles
    back = _to_mesh(part.surface_points(MOST, rng), points, triangles)
    found = {
        "valid": part.is_valid,
        "solids": len(part.solids),
        "faces": len(part.faces),
        "volume": part.volume,
        "diagonal": size,
        "to_part": there.max() / size,
        "to_volume": back.max() / size,
        "rms": float(np.sqrt(np.mean(np.concatenate([there, back]) ** 2))) / size,
        "fineness": fineness,
    }
    return found | edges(part, boundary)


def edges(part: Brep, boundary: Boundary) -> dict[str, Any]:
    """Return the distances of the part's sharp edges and corners from those of the volume; None where it has none."""
    sharp, corners, size = part.sharp_points, part.corners, part.diagonal
    found: dict[str, Any] = {"edges": len(part.sharp_edges), "corners": len(corners)}
    points, segments = boundary.sharp_edges
    if len(sharp):
        away = _to_mesh(sharp, points, segments) if len(segments) else np.full(len(sharp), size)
        found |= {"edges_rms": float(np.sqrt(np.mean(away**2))) / size, "edges_max": away.max() / size}
    if len(corners):
        found["corners_max"] = nearest(corners, boundary.corners).max() / size
    return found


def chosen(part: Brep, points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return at most MOST points: of more, those that seem farthest, and others by chance."""
    if len(points) <= MOST:
        return points
    order = np.argsort(-part.mesh_distances(points))
    return points[np.concatenate([order[: MOST // 2], rng.permutation(order[MOST // 2 :])[: MOST - MOST // 2]])]


def _to_mesh(points: np.ndarray, vertices: np.ndarray, elements: np.ndarray) -> np.ndarray:
    squared = igl.point_mesh_squared_distance(points, vertices, elements)[0]
    return np.sqrt(np.maximum(squared, 0.0))


def main(argv: list[str]) -> None:
    """Print the distances as JSON."""
    step, volume = map(Path, argv)
    found = measured(Brep.load(step), Boundary.load(volume))
    print(json.dumps({name: value.item() if isinstance(value, np.generic) else value for name, value in found.items()}))


if __name__ == "__main__":
    main(sys.argv[1:])
