"""Bodies of several patches by formula for the tests."""

from dataclasses import replace

import numpy as np
from rational_shapes import quarter_ring
from volumes import mapped

from parameterize.spline.body import Body
from parameterize.spline.volume import BSplineVolume


def turned(volume, order=(0, 1, 2), back=(False, False, False)):
    """The same volume with its parameters in another order, and then some of them reversed."""
    degrees, knots = (tuple(part[a] for a in order) for part in (volume.degrees, volume.knots))
    ways = tuple(slice(None, None, -1 if b else 1) for b in back)
    net = volume.control_points.transpose(*order, 3)[ways]
    weights = None if volume.weights is None else volume.weights.transpose(order)[ways]
    knots = tuple(1.0 - k[::-1] if b else k for k, b in zip(knots, back, strict=True))
    return BSplineVolume(degrees, knots, net, weights)


def row_of(places, turns, degrees=(2, 3, 1), shape=(4, 5, 3)):
    """Bent boxes at whole places (x, y, z), each turned in its way, glued where they touch.

    All have the same degrees and numbers of control points in x, y and z.
    """

    def patch(place):
        def bent(u, v, w):
            x, y, z = (coordinate + start for coordinate, start in zip((u, v, w), place, strict=True))
            return x + 0.1 * np.sin(y + z), y + 0.1 * np.sin(z - x), z + 0.05 * np.sin(x * y)

        return mapped(bent, shape, degrees)

    patches = [turned(patch(place), *turn) for place, turn in zip(places, turns, strict=True)]
    return Body.from_patches(patches)


def exact_ring():
    """A ring with circular walls, of four rational quarters."""
    quarters, quarter = [], quarter_ring()
    for number in range(4):
        turn = np.linalg.matrix_power(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), number)
        quarters.append(replace(quarter, control_points=quarter.control_points @ turn.T))
    return Body.from_patches(quarters)


def ring(patches, shape=(6, 4, 3), degrees=(2, 2, 1), twist=0.0):
    """A ring of patches around the z axis; the section turns by `twist` half turns on the way."""

    def part(number):
        def place(u, v, w):
            angle = 2.0 * np.pi * (u + number) / patches
            a, b, turn = 0.5 * (v - 0.5), 0.3 * (w - 0.5), 0.5 * twist * angle
            radius, height = 2.0 + np.cos(turn) * a - np.sin(turn) * b, np.sin(turn) * a + np.cos(turn) * b
            return radius * np.cos(angle), radius * np.sin(angle), height

        return mapped(place, shape, degrees)

    return Body.from_patches([part(number) for number in range(patches)])


def hollow():
    """A cube from -2 to 2 with a cubic hole from -1/2 to 1/2 inside, of six blocks."""

    def block(axis, side):
        b, c = (axis + 1) % 3, (axis + 2) % 3

        def place(u, v, w):
            far = 0.5 + 1.5 * w
            found = [None, None, None]
            found[axis], found[b], found[c] = side * far, side * far * (2.0 * u - 1.0), far * (2.0 * v - 1.0)
            return tuple(found)

        return mapped(place, (2, 2, 2), (1, 1, 1))

    return Body.from_patches([block(axis, side) for axis in range(3) for side in (1.0, -1.0)])
