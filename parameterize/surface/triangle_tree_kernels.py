"""Compiled loops of TriangleTree: they take longer to load than a check of a few triangles."""

import numba
import numpy as np

from ..arrays import Array, IntArray


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def order(order: IntArray, middles: Array, leaves: int) -> None:
    """Order triangles (m,) so that each node's own follow one another.

    The triangles of a node are halved along the longest side of the box of their middles (m, 3).
    """
    low, high, nodes = np.empty(3), np.empty(3), 1
    while nodes < leaves:
        for node in range(nodes):
            first, end = _share(len(order), node, nodes)
            half = _share(len(order), 2 * node, 2 * nodes)[1]
            if first < half < end:
                low[:], high[:] = np.inf, -np.inf
                for t in order[first:end]:
                    for d in range(3):
                        low[d], high[d] = min(low[d], middles[t, d]), max(high[d], middles[t, d])
                longest = 0
                for d in range(1, 3):
                    longest = d if high[d] - low[d] > high[longest] - low[longest] else longest
                _halve(order, middles[:, longest], first, half, end - 1)
        nodes *= 2


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _halve(order: IntArray, values: Array, first: int, half: int, last: int) -> None:
    """Order rows so that none before place `half` has a larger value than one from there on (Hoare's selection)."""
    while first < last:
        pivot = values[order[(first + last) // 2]]
        low, high = first, last
        while low <= high:
            while values[order[low]] < pivot:
                low += 1
            while values[order[high]] > pivot:
                high -= 1
            if low <= high:
                order[low], order[high] = order[high], order[low]
                low, high = low + 1, high - 1
        if half <= high:
            last = high
        elif half >= low:
            first = low
        else:
            return


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boxes_of(corners: Array, leaves: int) -> Array:
    """Return the lowest and highest corners (2 leaves, 2, 3) of the nodes' boxes: node k has the nodes 2 k and 2 k + 1.

    Leaf i, node leaves + i, has an equal share of the triangles (m, 3, 3).
    """
    boxes = np.empty((2 * leaves, 2, 3))
    boxes[:, 0], boxes[:, 1] = np.inf, -np.inf
    for node in range(2 * leaves - 1, 0, -1):
        box = boxes[node]
        if node >= leaves:
            first, end = _share(len(corners), node - leaves, leaves)
            for t in range(first, end):
                for k in range(3):
                    for d in range(3):
                        box[0, d], box[1, d] = min(box[0, d], corners[t, k, d]), max(box[1, d], corners[t, k, d])
        else:
            for child in (boxes[2 * node], boxes[2 * node + 1]):
                for d in range(3):
                    box[0, d], box[1, d] = min(box[0, d], child[0, d]), max(box[1, d], child[1, d])
    return boxes


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def look_in(boxes: Array, corners: Array, points: Array, squared: Array, found: IntArray, weights: Array) -> None:
    """Fill in the squared distances (k,) of points (k, 3), the rows (k,) of the nearest triangles, and the weights."""
    leaves, last = len(boxes) // 2, 0
    waiting, least = np.empty(64, dtype=np.int64), np.empty(64)
    own = np.empty(3)
    for i in range(len(points)):
        x, y, z = points[i]
        best = np.inf
        waiting[0], least[0], count = 1, 0.0, 1
        first, end = last, last + 1
        while True:
            for t in range(first, end):
                distance = _to_triangle(x, y, z, corners, t, best, own)
                if distance < best or (distance == best and t < last):
                    best, last = distance, t
                    weights[i, 0], weights[i, 1], weights[i, 2] = own[0], own[1], own[2]
            first = end = 0
            while count and end == 0:
                count -= 1
                node = waiting[count]
                if least[count] > best:
                    continue
                if node >= leaves:
                    first, end = _share(len(corners), node - leaves, leaves)
                    continue
                one, other = _to_box(x, y, z, boxes, 2 * node), _to_box(x, y, z, boxes, 2 * node + 1)
                is_one = one <= other  # the nearer one is looked at first, so it waits on top
                waiting[count], least[count] = 2 * node + is_one, max(one, other)
                waiting[count + 1], least[count + 1] = 2 * node + 1 - is_one, min(one, other)
                count += 2
            if end == 0:
                break
        squared[i], found[i] = best, last


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _share(count: int, leaf: int, leaves: int) -> tuple[int, int]:
    """Return the first of `count` triangles that a leaf has, and the one after its last."""
    return count * leaf // leaves, count * (leaf + 1) // leaves


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _to_box(x: float, y: float, z: float, boxes: Array, node: int) -> float:
    """Return the squared distance of a point to a box."""
    dx = max(boxes[node, 0, 0] - x, x - boxes[node, 1, 0], 0.0)
    dy = max(boxes[node, 0, 1] - y, y - boxes[node, 1, 1], 0.0)
    dz = max(boxes[node, 0, 2] - z, z - boxes[node, 1, 2], 0.0)
    return dx * dx + dy * dy + dz * dz


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _to_triangle(x: float, y: float, z: float, corners: Array, t: int, best: float, weights: Array) -> float:
    """Return the squared distance of a point to a triangle, and write down the weights of its nearest point.

    It is infinite, and the weights are none, where the triangle's plane is farther than `best`.
    """
    ux, uy, uz = _to_point(corners, t, 0, x, y, z)
    vx, vy, vz = _to_point(corners, t, 1, x, y, z)
    wx, wy, wz = _to_point(corners, t, 2, x, y, z)
    nx, ny, nz = _cross(vx - ux, vy - uy, vz - uz, wx - ux, wy - uy, wz - uz)
    size, height = nx * nx + ny * ny + nz * nz, nx * ux + ny * uy + nz * uz
    if height * height > best * size and size > 0.0:
        return np.inf
    ax, ay, az = _cross(vx, vy, vz, wx, wy, wz)
    bx, by, bz = _cross(wx, wy, wz, ux, uy, uz)
    cx, cy, cz = _cross(ux, uy, uz, vx, vy, vz)
    a, b, c = ax * nx + ay * ny + az * nz, bx * nx + by * ny + bz * nz, cx * nx + cy * ny + cz * nz
    if size > 0.0 and a >= 0.0 and b >= 0.0 and c >= 0.0:
        total = a + b + c
        weights[0], weights[1], weights[2] = a / total, b / total, c / total
        return height * height / size
    first, share_of_first = _to_edge(ux, uy, uz, vx, vy, vz)
    second, share_of_second = _to_edge(vx, vy, vz, wx, wy, wz)
    third, share_of_third = _to_edge(wx, wy, wz, ux, uy, uz)
    if first <= second and first <= third:
        weights[0], weights[1], weights[2] = 1.0 - share_of_first, share_of_first, 0.0
    elif second <= third:
        weights[0], weights[1], weights[2] = 0.0, 1.0 - share_of_second, share_of_second
    else:
        weights[0], weights[1], weights[2] = share_of_third, 0.0, 1.0 - share_of_third
    return min(first, second, third)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _to_edge(ux: float, uy: float, uz: float, vx: float, vy: float, vz: float) -> tuple[float, float]:
    """Return the squared distance of an edge from u to v to the origin, and its nearest point as a share of it."""
    dx, dy, dz = vx - ux, vy - uy, vz - uz
    share = -(dx * ux + dy * uy + dz * uz) / max(dx * dx + dy * dy + dz * dz, 1e-300)
    share = min(max(share, 0.0), 1.0)
    ux, uy, uz = ux + share * dx, uy + share * dy, uz + share * dz
    return ux * ux + uy * uy + uz * uz, share


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _to_point(corners: Array, t: int, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a corner of a triangle, seen from a point."""
    return corners[t, k, 0] - x, corners[t, k, 1] - y, corners[t, k, 2] - z


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _cross(x: float, y: float, z: float, u: float, v: float, w: float) -> tuple[float, float, float]:
    """Return a cross product."""
    return y * w - z * v, z * u - x * w, x * v - y * u
