"""Bodies whose surfaces are planes: sums and differences of boxes and prisms, as vertices and triangles."""

import numpy as np
from manifold3d import CrossSection, Manifold

from parameterize.layouts.planes.exact_blocks import exact_blocks


def box(low, high):
    """A box between two corners."""
    size = np.subtract(high, low).astype(float)
    return Manifold.cube(tuple(size)).translate(tuple(map(float, low)))


def prism(outline, height, *holes):
    """A polygon, counterclockwise, with clockwise holes, extruded."""
    return CrossSection([outline, *holes]).extrude(height)


def ring(corners, radius, center=(0.0, 0.0)):
    """The corners of a regular polygon, counterclockwise."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    return np.stack([center[0] + radius * np.cos(angles), center[1] + radius * np.sin(angles)], axis=1)


def hull(*corners):
    """The convex hull of points."""
    return Manifold.hull_points(np.array(corners, dtype=float))


def frustum(low, high, height, z=0.0):
    """A pyramid of square base, cut off: sides `low` and `high`, centred on the z axis."""
    ends = ((low / 2, z), (high / 2, z + height))
    return hull(*((x * half, y * half, level) for half, level in ends for x in (-1, 1) for y in (-1, 1)))


def sheared(body):
    """A body with oblique edges."""
    return body.transform(np.array([[1.0, 0.3, 0.2, 0.0], [0.0, 1.0, 0.4, 0.0], [0.0, 0.0, 1.0, 0.0]]))


def arrays(body):
    """The vertices (n, 3) and the triangles (m, 3) of a body, or of the one with this name, in double precision."""
    if isinstance(body, str):
        body = BODIES[body][0]()
    mesh = body.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64)


def blocks_of(vertices, faces, most=None):
    """The exact blocks of a body, six spans across a cube; None where it has none."""
    blocks = exact_blocks(vertices, faces, most)
    return None if blocks is None else blocks.with_even_spans(blocks.lengths, 6)


L = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
BODIES = {  # what makes each body, and the number of its blocks
    "box": (lambda: box((0, 0, 0), (1, 2, 3)), 1),
    "sheared box": (lambda: sheared(box((0, 0, 0), (1, 2, 3))), 1),
    "frustum": (lambda: frustum(2.0, 1.0, 1.5), 1),
    "frustum as wide as the block below": (lambda: box((-1, -1, 0), (1, 1, 1)) + frustum(2.0, 1.0, 0.5, 1.0), 2),
    "octahedron": (lambda: hull((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)), 16),
    "wedge": (lambda: prism([(0, 0), (2, 0), (0, 1)], 1.5), 3),
    "L": (lambda: prism(L, 2.0), 3),
    "sheared L": (lambda: sheared(prism(L, 2.0)), 3),
    "T": (lambda: box((1, 0, 0), (2, 2, 1)) + box((0, 2, 0), (3, 3, 1)), 4),
    "U": (lambda: box((0, 0, 0), (3, 3, 1)) - box((1, 1, -1), (2, 4, 2)), 5),
    "notch": (lambda: box((0, 0, 0), (2, 2, 2)) - box((1, 1, 1), (3, 3, 3)), 7),
    "pocket": (lambda: box((0, 0, 0), (3, 3, 2)) - box((1, 1, 1), (2, 2, 3)), 17),
    "tunnel": (lambda: box((0, 0, 0), (3, 3, 2)) - box((1, 1, -1), (2, 2, 3)), 8),
    "pyramid on a block": (lambda: box((-1, -1, 0), (1, 1, 1)) + frustum(1.2, 0.6, 0.8, z=1.0), 10),
    "flat pyramid on a block": (lambda: box((-1, -1, 0), (1, 1, 1)) + frustum(1.2, 0.4, 0.3, z=1.0), 10),
    "L with a chamfer": (lambda: prism([(0, 0), (3, 0), (3, 0.6), (2.6, 1), (1, 1), (1, 3), (0, 3)], 1.0), 3),
    "plate with a hexagonal hole": (lambda: prism([(-2, -2), (2, -2), (2, 2), (-2, 2)], 0.5, ring(6, 0.8)[::-1]), 6),
    "tetrahedron": (lambda: hull((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), 4),
}
