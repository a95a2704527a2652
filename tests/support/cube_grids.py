"""Bodies of several patches by formula: boxes glued in a grid, and a ring."""

from __future__ import annotations

from itertools import product

import numpy as np

from iga_nn import Body, BSplineVolume


def box(corner: tuple[float, ...], spans: int = 2, degree: int = 3) -> BSplineVolume:
    """The unit cube with its least corner at a point."""
    x, y, z = corner
    return BSplineVolume.from_function(lambda u, v, w: (x + u, y + v, z + w), spans + degree, degree)


def glued(corners: list[tuple[int, ...]], spans: int = 2, degree: int = 3) -> Body:
    return Body.from_patches([box(corner, spans, degree) for corner in corners])


def two(spans: int = 2, degree: int = 3) -> Body:
    return glued([(0, 0, 0), (1, 0, 0)], spans, degree)


def plate(spans: int = 2, degree: int = 3) -> Body:
    """Eight cubes around a hole."""
    return glued([(i, j, 0) for i, j in product(range(3), repeat=2) if (i, j) != (1, 1)], spans, degree)


def frame(spans: int = 2, degree: int = 3) -> Body:
    """The edges of a cube, 20 patches: genus 5."""
    return glued([c for c in product(range(3), repeat=3) if c.count(1) < 2], spans, degree)


def ring(spans: int = 8, degree: int = 3, patches: int = 1) -> Body:
    """A ring of radii 1 and 2 and height 1, cut into patches; one patch is glued to itself."""

    def part(number: int) -> BSplineVolume:
        def place(u, v, w):
            angle = (number + u) * 2.0 * np.pi / patches
            return (1.0 + v) * np.cos(angle), (1.0 + v) * np.sin(angle), w

        counts = (2 * max(spans // patches, 1) + degree, *[max(spans // 2, 1) + degree] * 2)
        return BSplineVolume.from_function(place, counts, degree)

    return Body.from_patches([part(number) for number in range(patches)])


def held_at(body: Body, face: str) -> dict[str, None]:
    """The exact flux on all outer faces but one."""
    labels = [f"p{i}_{name}" for i, faces in enumerate(body.outer) for name in faces]
    return {label: None for label in labels if label != face}


def row_of(counts: tuple[int, ...], degree: int = 2) -> Body:
    """Return a row of blocks along x, one for each number of control points along x."""
    return Body.from_patches(
        [
            BSplineVolume.from_function(
                lambda u, v, w, a=a: (a + u + 0.1 * np.sin(3 * v) * w, v, w + 0.1 * u * v), (count, 4, 3), degree
            )
            for a, count in enumerate(counts)
        ]
    )
