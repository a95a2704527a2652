"""The deepest interior point of a closed surface."""

import igl
import numpy as np

from ..arrays import Array, IntArray

CELLS = 16  # along the box's longest side, to start with
TOLERANCE = 1e-3  # of the depth
MOST_CELLS = 4000  # kept a level; only sheets thinner than a hundredth of the box reach it
LEVELS = 16


def deepest_point(vertices: Array, faces: IntArray) -> tuple[Array, float]:
    """Return the interior point (3,) farthest from the surface, to a thousandth of its depth, and that depth.

    Branch and bound over cells: the signed distance changes by no more than the way walked, so a cell whose centre's
    depth plus half its diagonal falls short of the best depth found cannot hold the deepest point. Deterministic.
    """
    tree, winding = igl.AABB(), igl.FastWindingNumberBVH()
    tree.init(vertices, faces)
    winding.init(vertices, faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    side = float((high - low).max()) / CELLS
    counts = np.maximum(np.ceil((high - low) / side - 1e-9).astype(int), 1)
    axes = [middle + side * (np.arange(n) - (n - 1) / 2) for middle, n in zip((low + high) / 2, counts, strict=True)]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)  # (cells, 3)
    octants = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    best, depth = centers[0], -np.inf
    for _ in range(LEVELS):
        distance = np.sqrt(tree.squared_distance(vertices, faces, centers)[0])
        distance[winding.winding_number(centers, 2.0) < 0.5] *= -1.0
        top = int(np.argmax(distance))
        if distance[top] > depth:
            best, depth = centers[top], float(distance[top])
        reach = distance + side * np.sqrt(3.0) / 2.0
        hopeful = np.flatnonzero(reach > max(depth, 0.0) * (1.0 + TOLERANCE))
        if not len(hopeful):
            break
        hopeful = hopeful[np.argsort(-reach[hopeful], kind="stable")[:MOST_CELLS]]
        centers = (centers[hopeful, None] + side * octants).reshape(-1, 3)
        side /= 2.0
    return best, depth
