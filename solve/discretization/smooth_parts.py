"""Divides patches where their spaces are only continuous, so that derivatives jump at interfaces alone."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise, product

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import between
from parameterize.spline.interface import Interface, face_layer
from parameterize.spline.volume import AXES

from .residual import Solved
from .space import TrialSpace


def smooth_parts(
    patches: Sequence[Solved], interfaces: Sequence[Interface]
) -> tuple[Sequence[Solved], Sequence[Interface]]:
    """Return patches and interfaces of the same body, divided where a space is only continuous."""
    cuts = [list(map(_kinks, map(bytes, one.space.whole.knots), one.space.degrees)) for one in patches]
    if not any(len(row) for own in cuts for row in own):
        return patches, interfaces
    parts: list[Solved] = []
    numbers: list[IntArray] = []
    for patch, own in zip(patches, cuts, strict=True):
        shape = tuple(len(row) + 1 for row in own)
        numbers.append(len(parts) + np.arange(np.prod(shape)).reshape(shape))
        parts += _divided_at(patch, own)
    found = []
    for grid in numbers:
        for axis, name in enumerate(AXES):
            behind, ahead = np.delete(grid, -1, axis), np.delete(grid, 0, axis)
            pairs = zip(behind.ravel().tolist(), ahead.ravel().tolist(), strict=True)
            found += [Interface((i, f"{name}1"), (j, f"{name}0")) for i, j in pairs]
    for interface in interfaces:
        (p, face_p), (q, face_q) = interface.first, interface.second
        first, second = face_layer(numbers[p], face_p), interface.turned(face_layer(numbers[q], face_q))
        pairs = zip(first.ravel().tolist(), second.ravel().tolist(), strict=True)
        found += [replace(interface, first=(i, face_p), second=(j, face_q)) for i, j in pairs]
    return parts, found


@lru_cache(maxsize=64)  # thousands of patches have few knots
def _kinks(knots: bytes, degree: int) -> Array:
    """Return the inner knots at which splines are only continuous."""
    values, counts = np.unique(np.frombuffer(knots), return_counts=True)
    return np.asarray(values[1:-1][counts[1:-1] >= degree])


def _divided_at(patch: Solved, cuts: Sequence[Array]) -> Iterator[Solved]:
    """Yield the parts of a patch between parameters; along w one comes after the other."""
    pieces = [list(pairwise([0.0, *row.tolist(), 1.0])) for row in cuts]
    volumes = patch.volume.divided(*(row.tolist() for row in cuts)) if any(map(len, cuts)) else (patch.volume,)
    whole = patch.space
    for volume, ends in zip(volumes, product(*pieces), strict=True):
        rows = [between(whole.knots[a], whole.degrees[a], *ends[a]) for a in range(3)]
        at_ends = [f"{AXES[a]}{side}" for a, side in product(range(3), (0, 1)) if ends[a][side] == side]
        space = TrialSpace(
            whole.degrees,
            (rows[0][1], rows[1][1], rows[2][1]),
            tuple(name for name in whole.dirichlet if name in at_ends),
            tuple(name for name in whole.outer if name in at_ends),
        )
        coefficients = patch.coefficients[:, *(part for part, _ in rows)]
        yield Solved(
            volume, space, patch.problem, coefficients, patch.regions, patch.is_own, (ends[0], ends[1], ends[2])
        )
