"""Bodies of several patches by formula for the tests, and ways to place a patch in its cube."""

from itertools import permutations, product

import numpy as np

from parameterize.spline.body import Body
from parameterize.spline.interface import Interface
from parameterize.spline.volume import BSplineVolume

SYMMETRIES = [(axes, flips) for axes in permutations(range(3)) for flips in product((False, True), repeat=3)]  # 48


def patch(function, control_points=4):
    """The patch of degree 3 that is `function` at the Greville points."""
    return BSplineVolume.from_function(function, control_points)


def turned(volume, symmetry):
    """The same body with its parameters exchanged and reversed: half of the 48 ways change the handedness."""
    axes, flips = symmetry
    points = volume.control_points.transpose(*axes, 3)
    points = points[tuple(slice(None, None, -1 if flip else 1) for flip in flips)]
    rows = (
        1.0 - volume.knots[axis][::-1] if flip else volume.knots[axis] for axis, flip in zip(axes, flips, strict=True)
    )
    return BSplineVolume(tuple(volume.degrees[axis] for axis in axes), tuple(rows), points)


def cells(places, control_points=2, degree=1):
    """Unit cubes with their lower corners at places (n, 3)."""
    return [
        BSplineVolume.from_function(
            lambda u, v, w, place=place: (place[0] + u, place[1] + v, place[2] + w), control_points, degree
        )
        for place in np.asarray(places, dtype=float).tolist()
    ]


def grid(*counts):
    """The lower corners (n, 3) of a block of unit cubes."""
    return np.array(list(np.ndindex(*counts)))


def frame():
    """The edges of a cube of 3 x 3 x 3 cells: 20 patches, five handles."""
    return Body.from_patches(cells([cell for cell in np.ndindex(3, 3, 3) if sum(i == 1 for i in cell) < 2]))


def sector(start, end, height=1.0, radius=0.5):
    """A sector of a square plate with a round hole, between two angles in eighths of a turn."""

    def place(u, v, w):
        angle = (start + (end - start) * u) * np.pi / 4.0
        x, y = np.cos(angle), np.sin(angle)
        square = 1.0 / np.maximum(np.abs(x), np.abs(y))
        distance = (1.0 - v) * radius + v * square
        return distance * x, distance * y, height * w

    return place


def plate_with_hole(control_points=6):
    """A square plate of side 2 with a hole of radius 1/2: eight patches."""
    return Body.from_patches([patch(sector(k, k + 1), control_points) for k in range(8)])


def ring(start, end, radius=lambda angle: 1.0 + 0.0 * angle, lift=lambda angle: 0.0 * angle, shift=0.0):
    """A part of a ring of 0.6 x 0.6 between two angles in turns, around a curve radius(angle), lift(angle)."""

    def place(u, v, w):
        angle = 2.0 * np.pi * (start + (end - start) * u)
        distance = radius(angle) + 0.6 * (v - 0.5)
        return distance * np.sin(angle) + shift, distance * np.cos(angle), 0.6 * (w - 0.5) + lift(angle)

    return place


def around_a_line(count):
    """Unit cubes, each a quarter of a turn around the z axis after the one before, the last glued to the first."""

    def place(k):
        cos, sin = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][k % 4]
        return lambda u, v, w: (cos * u - sin * v, sin * u + cos * v, w)

    interfaces = (Interface((k, "u0"), ((k + 1) % count, "v0")) for k in range(count))
    return Body(tuple(patch(place(k)) for k in range(count)), tuple(interfaces))


def slit(gap, bend):
    """Four patches around a line that leave a slit of angle `gap` between its two curved walls; none where it is 0."""
    step = (2.0 * np.pi - gap) / 4.0

    def place(k):
        a, b = k * step, (k + 1) * step

        def at(u, v, w):
            x, y = u * np.cos(a) + v * np.cos(b), u * np.sin(a) + v * np.sin(b)
            return x, y + bend * np.sin(3.0 * x), w + 0.2 * x**2

        return at

    return Body.from_patches([patch(place(k), 8) for k in range(4)])


def met_twice():
    """A body in one part that covers a block of 3 x 3 x 2 cubes twice, although its boundary is two disjoint boxes.

    Two blocks, one with a cube more on every side, are cut open along the unit square in the middle of the smaller one,
    and each upper side of the cut is glued to the other block's lower side: around each edge of the square the patches
    turn twice.
    """
    blocks = [grid(5, 5, 4) - 1, grid(3, 3, 2)]
    places = [(block, tuple(place)) for block, own in enumerate(blocks) for place in own.tolist()]
    number = {place: k for k, place in enumerate(places)}
    interfaces = []
    for block, place in places:
        for axis, name in enumerate("uvw"):
            above = tuple(np.add(place, np.eye(3, dtype=int)[axis]).tolist())
            other = 1 - block if (place, axis) == ((1, 1, 0), 2) else block
            if (other, above) in number:
                faces = (number[block, place], f"{name}1"), (number[other, above], f"{name}0")
                interfaces.append(Interface(*faces))
    return Body(tuple(cells([place for _, place in places])), tuple(interfaces))
