"""Bodies of genus 0 with four or more limbs, fingers among them: capsules and blobs that have grown together.

Their triangles are fine, so that a map's distance is not that of the facets from the smooth body.
"""

from __future__ import annotations

import numpy as np
from distance_fields import Field, Triangles, capsule, contour, ellipsoid, evened, joined, on_zero, tube
from everyday_smooth import curve

CELL = 0.02  # of the grid on which a surface is found
FACES = 36_000


def limb(points: list[list[float]], start: float, end: float) -> Field:
    """Return the field of a limb along a smooth curve, its radius changing evenly from start to end."""
    return tube(curve(points, count=300), np.linspace(start, end, 300))


def mirrored(points: list[list[float]]) -> list[list[float]]:
    """Return the points on the other side of the plane y = 0."""
    return [[x, -y, z] for x, y, z in points]


def grown_together(fillet: float, parts: list[Field]) -> Triangles:
    """Return the surface of the union of parts, with fillets of about that radius, in triangles of even size."""
    field = joined(fillet, *parts)
    points, faces = evened(*contour(field, CELL), FACES)
    return on_zero(field, points), faces


def hand() -> Triangles:
    """Return a hand with five spread fingers on a forearm."""
    palm = [capsule([0.1, y, 0.0], [1.0, 1.25 * y, 0.0], 0.26) for y in (-0.42, -0.14, 0.14, 0.42)]
    parts: list[Field] = [*palm, limb([[-2.4, 0, 0], [-1.2, 0, 0], [0, 0, 0]], 0.5, 0.36)]
    fingers = zip((-0.55, -0.18, 0.18, 0.55), (1.0, 1.3, 1.4, 1.2), strict=True)
    for y, length in fingers:
        reach = [1.0 + length, 1.6 * y, 0.1 * length]
        parts.append(limb([[0.9, y, 0.0], [1.0 + 0.5 * length, 1.35 * y, 0.12], reach], 0.19, 0.13))
    parts.append(limb([[0.1, 0.3, 0.0], [0.55, 0.95, 0.1], [1.0, 1.35, 0.25]], 0.26, 0.16))
    return grown_together(0.1, parts)


def octopus() -> Triangles:
    """Return a head with eight arms that curl at their ends."""
    parts: list[Field] = [ellipsoid([0, 0, 0.7], [0.75, 0.75, 1.0])]
    for i, angle in enumerate(2.0 * np.pi * np.arange(8) / 8.0):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        side = np.array([-out[1], out[0], 0.0])
        bend = 0.35 if i % 2 else -0.25
        stations = ((0.3, 0.1, 0.0), (1.1, -0.35, 0.0), (2.0, -0.4, bend), (2.8, 0.1 + bend, 2.0 * bend))
        parts.append(limb([list(r * out + s * side + [0, 0, z]) for r, z, s in stations], 0.3, 0.11))
    return grown_together(0.2, parts)


def dog() -> Triangles:
    """Return a dog: a body with four legs, neck and head with two ears, and a tail."""
    trunk = [capsule([-1.0, 0, 0], [0.9, 0, 0.1], 0.48, 0.56), capsule([0.9, 0, 0.25], [1.5, 0, 0.85], 0.4, 0.3)]
    parts: list[Field] = [
        *trunk,
        ellipsoid([1.7, 0, 1.05], [0.42, 0.36, 0.36]),
        capsule([1.8, 0, 1.0], [2.4, 0, 0.85], 0.24, 0.16),
    ]
    for x, knee in ((-1.05, -1.25), (0.85, 0.9)):
        leg = [[x, 0.32, -0.1], [knee, 0.38, -0.9], [x, 0.4, -1.7], [x + 0.3, 0.4, -1.85]]
        parts += [limb(leg, 0.3, 0.15), limb(mirrored(leg), 0.3, 0.15)]
    ear = [[1.6, 0.25, 1.3], [1.55, 0.45, 1.65]]
    parts += [capsule(*ear, 0.14, 0.09), capsule(*mirrored(ear), 0.14, 0.09)]
    parts.append(limb([[-1.3, 0, 0.2], [-1.8, 0, 0.5], [-2.0, 0.1, 1.1], [-1.8, 0.2, 1.5]], 0.2, 0.1))
    return grown_together(0.15, parts)


def starfish() -> Triangles:
    """Return a starfish, five arms that bend and taper."""
    parts: list[Field] = [ellipsoid([0, 0, 0], [0.6, 0.6, 0.4])]
    for i, angle in enumerate(2.0 * np.pi * np.arange(5) / 5.0):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        side = np.array([-out[1], out[0], 0.0])
        stations = ((0.2, 0.0), (1.2, 0.1), (2.2, 0.45 - 0.2 * i))
        parts.append(limb([list(r * out + s * side + [0, 0, 0.1 * s * r]) for r, s in stations], 0.42, 0.14))
    return grown_together(0.25, parts)


def brittle_star() -> Triangles:
    """Return a brittle star: a small disc with five long arms that wind."""
    parts: list[Field] = [ellipsoid([0, 0, 0], [0.55, 0.55, 0.3])]
    for i, angle in enumerate(2.0 * np.pi * np.arange(5) / 5.0):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        side = np.array([-out[1], out[0], 0.0])
        bend = 0.3 if i % 2 else -0.3
        stations = ((0.2, 0.0, 0.0), (1.1, bend, 0.1), (2.1, -0.5 * bend, -0.05), (3.1, 0.8 * bend, 0.15))
        parts.append(limb([list(r * out + s * side + [0, 0, z]) for r, s, z in stations], 0.26, 0.11))
    return grown_together(0.2, parts)


def gecko() -> Triangles:
    """Return a gecko: a bent trunk with a head and a tail, and four legs to its sides."""
    trunk = [[-1.2, 0.1, 0], [-0.4, -0.05, 0], [0.4, 0.05, 0], [1.2, 0, 0]]
    parts: list[Field] = [limb(trunk, 0.32, 0.34), ellipsoid([1.75, 0, 0.02], [0.5, 0.36, 0.28])]
    parts.append(limb([[-1.1, 0.1, 0], [-1.9, 0.25, 0], [-2.6, -0.05, 0], [-3.2, -0.45, 0]], 0.28, 0.1))
    for x, side in ((-0.9, -1.0), (0.85, 1.0)):
        leg = [[x, 0.1, 0], [x - 0.1 * side, 0.75, 0.05], [x + 0.35 * side, 1.25, -0.15]]
        parts += [limb(leg, 0.22, 0.15), limb(mirrored(leg), 0.22, 0.15)]
    return grown_together(0.15, parts)


def giraffe() -> Triangles:
    """Return a giraffe: a short trunk on four long legs, a long neck, a head and a tail."""
    parts: list[Field] = [
        capsule([-0.6, 0, 0], [0.6, 0, 0.25], 0.42, 0.48),
        ellipsoid([1.95, 0, 2.3], [0.42, 0.2, 0.2]),
    ]
    parts.append(limb([[0.6, 0, 0.3], [1.1, 0, 1.0], [1.4, 0, 1.7], [1.6, 0, 2.35]], 0.36, 0.18))
    parts.append(limb([[-0.8, 0, 0.1], [-1.15, 0, 0], [-1.3, 0, -0.6]], 0.16, 0.09))
    for x in (-0.6, 0.65):
        leg = [[x, 0.24, -0.1], [x + 0.06, 0.28, -0.9], [x - 0.04, 0.3, -1.8], [x, 0.32, -2.4]]
        parts += [limb(leg, 0.24, 0.13), limb(mirrored(leg), 0.24, 0.13)]
    return grown_together(0.15, parts)


def mannequin() -> Triangles:
    """Return a mannequin with a head, arms held away from the body, and legs."""
    parts: list[Field] = [
        capsule([0, 0, -0.5], [0, 0, 0.55], 0.36, 0.42),
        capsule([0, 0, 0.7], [0, 0, 1.2], 0.18),
        ellipsoid([0, 0, 1.5], [0.3, 0.34, 0.4]),
    ]
    arm = [[0, 0.3, 0.7], [0.05, 0.9, 0.45], [-0.05, 1.45, -0.1], [0.15, 1.8, -0.65]]
    leg = [[0, 0.2, -0.6], [0.08, 0.32, -1.5], [-0.05, 0.4, -2.4], [0.0, 0.42, -2.75], [0.35, 0.45, -2.9]]
    for one, start, end in ((arm, 0.2, 0.12), (leg, 0.28, 0.14)):
        parts += [limb(one, start, end), limb(mirrored(one), start, end)]
    return grown_together(0.12, parts)


def ant() -> Triangles:
    """Return an ant: three parts of a body, six legs with knees, two feelers."""
    parts: list[Field] = [
        ellipsoid([-1.5, 0, 0.1], [0.85, 0.6, 0.55]),
        ellipsoid([0, 0, 0], [0.7, 0.38, 0.38]),
        ellipsoid([1.15, 0, 0.15], [0.5, 0.48, 0.4]),
        capsule([-1.5, 0, 0.1], [1.15, 0, 0.15], 0.17),
    ]
    legs = ([[-0.35, 0.2, 0], [-0.9, 1.1, 0.6], [-1.5, 1.9, -0.9]], [[0, 0.25, 0], [0.05, 1.2, 0.6], [0.1, 2.1, -0.9]])
    for leg in (*legs, [[0.35, 0.2, 0], [0.95, 1.1, 0.6], [1.6, 1.8, -0.9]]):
        parts += [_with_a_knee(leg), _with_a_knee(mirrored(leg))]
    feeler = [[1.4, 0.2, 0.3], [1.9, 0.5, 0.9], [2.5, 0.7, 0.8]]
    parts += [limb(feeler, 0.12, 0.08), limb(mirrored(feeler), 0.12, 0.08)]
    return grown_together(0.1, parts)


def _with_a_knee(leg: list[list[float]]) -> Field:
    hip, knee, foot = (np.array(point) for point in leg)
    return joined(0.05, capsule(hip, knee, 0.14, 0.12), capsule(knee, foot, 0.12, 0.1))
