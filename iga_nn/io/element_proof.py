"""Proves det J > 0 of elements as they are written, and halves those for which it does not hold.

An element through the nodes of a certified map is another map, which may fold. Its det J is a polynomial: where its
Bernstein coefficients are positive, it is. The nodes are rounded as the file rounds them.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.certificate.determinant import DeterminantForm
from parameterize.certificate.jacobian import certify_patches
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.volume import BSplineVolume

from ..errors import InputError
from .element_shapes import ElementShape
from .elements import Elements

log = logging.getLogger(__name__)

ROUNDS = 8  # of halvings, at most
DEPTH = 6  # how often a doubtful element is cut in eight for its proof
MOST = 2_000_000  # elements: halving that leads to more is refused


def proved(elements: Elements, shape: ElementShape) -> tuple[Elements, int]:
    """Return elements, finer where needed, of which det J > 0 is proved as the shape has it; and how many were halved.

    Raises InputError where elements are still folded after ROUNDS halvings.
    """
    first = None
    for _ in range(ROUNDS + 1):
        failing = unproved(rounded(elements.points), shape.chosen(elements.cells), shape)
        first = len(failing) if first is None else first
        if not len(failing):
            return replace(elements, points=rounded(elements.points)), first
        finer = elements.finer(failing)
        if len(finer) > MOST:
            break
        log.info("%d of %d elements are not proved to be unfolded; their spans are halved", len(failing), len(elements))
        elements = finer
    raise InputError(
        f"{len(failing)} of {len(elements)} elements of type {shape.name} fold, or nearly, also once they are halved: "
        "map the part with more control points, or export it --to vtk, which is exact"
    )


def unproved(points: Array, cells: IntArray, shape: ElementShape) -> IntArray:
    """Return the elements of which det J > 0 on the whole is not proved.

    points: (n, 3). cells: (e, k), the nodes of each in the shape's order.
    """
    q = shape.degree
    nets = np.einsum("bk,ekc->ebc", shape.to_bernstein, points[cells]).reshape(-1, *[q + 1] * 3, 3)
    knots = np.repeat([0.0, 1.0], q + 1)
    group = PatchGroup(np.arange(len(nets)), (q, q, q), (knots,) * 3, nets)
    doubtful = []
    for part in group.divided(4096):
        bounds, _, _ = DeterminantForm(part).survey()
        doubtful.append(part.numbers[~(bounds[0, :, 0] > 0.0)])
    return np.array([e for e in np.concatenate(doubtful).tolist() if not _is_proved(nets[e], group)], dtype=np.int64)


def _is_proved(net: Array, group: PatchGroup) -> bool:
    """Return whether det J > 0 is proved for a control net of a group's degrees and knots."""
    volume = BSplineVolume(group.degrees, group.knots, net)
    own = PatchGroup(np.array([0]), group.degrees, group.knots, net[None])
    (found,) = certify_patches([volume], own, DEPTH)
    return found.verdict == "certified" and not found.left_handed


def rounded(points: Array) -> Array:
    """Return numbers as they are read from a file that holds 13 digits of them."""
    return np.array([f"{value:.12e}" for value in points.ravel().tolist()]).astype(np.float64).reshape(points.shape)
