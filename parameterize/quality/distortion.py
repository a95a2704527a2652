"""ARAP distortion and the scaled Jacobian of a map: of matrices, and of a volume on tensor grids of parameters.

A volume that is one image of the cube is measured against the cube, at volume 1. A block of several is measured against
its own box, whose sides are the mean lengths of F_u, F_v and F_w: a long straight block is not distorted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray
from ..spline.body import BodyLike, as_body
from ..spline.bspline import gauss_points
from ..spline.orientation import orientation, orientations
from ..spline.patch_groups import PatchGroup, group_of
from ..spline.volume import BSplineVolume
from .rotations import closest_rotations

_SLAB_POINTS = 100_000
_N_GAUSS = 3  # points a direction and span

Rules = Sequence[tuple[Array, Array]]  # points and weights (n_spans, n_gauss) of each direction


@dataclass(frozen=True)
class Distortion:
    """ARAP distortion: mean is the integral over the cube, max the largest at the quadrature points."""

    mean: float
    max: float


@dataclass(frozen=True)
class BoxDistortion:
    """How much a volume distorts its own box; of a left-handed volume, what its mirror image does.

    Attributes
    ----------
    box : three float
        The sides of the box, in the volume's units: the mean lengths of F_u, F_v and F_w over the cube.
    volume : float
        The integral of det J.
    arap : Distortion
        Of the map from that box, in which no unit of length is left.
    scaled_jacobian : float
        The smallest det J over the product of its columns' lengths, at the quadrature points.
    points : int
        The number of quadrature points.

    Examples
    --------
    >>> import iga_nn
    >>> from parameterize.quality.distortion import in_own_box
    >>> rod = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, 5 * w), control_points=4)
    >>> found = in_own_box(rod)
    >>> round(found.box[2], 9), found.arap.max < 1e-12
    (5.0, True)
    """

    box: tuple[float, float, float]
    volume: float
    arap: Distortion
    scaled_jacobian: float
    points: int


def arap_grid(
    volume: BSplineVolume, n_gauss: int = _N_GAUSS, scales: tuple[float, ...] = (1.0,), box: ArrayLike = (1.0, 1.0, 1.0)
) -> tuple[tuple[Array, Array, Array], list[Array], Array]:
    """Return the ARAP distortion of scale * F, for each of the scales, at `n_gauss` Gauss points a direction and span.

    box: sides (3,) of the box that the map is measured against. Returns the points of each axis, the values
    (m_u, m_v, m_w) for each scale, and the weights of the integral over the cube.
    """
    group = group_of(volume)
    rules, weights = _rules(group, n_gauss)
    u, v, w = (points.ravel() for points, _ in rules)
    values = [np.empty((1, len(u), len(v), len(w))) for _ in scales]
    for part, jacobians in _slabs(group, rules):
        for row, found in zip(values, _arap(jacobians / np.asarray(box), scales), strict=True):
            row[part] = found
    return (u, v, w), [row[0] for row in values], weights


def in_own_box(volume: BSplineVolume) -> BoxDistortion:
    """Measure a volume against its own box, at three Gauss points a direction and span."""
    (found,) = in_own_boxes(volume)
    return found


def in_own_boxes(body: BodyLike) -> tuple[BoxDistortion, ...]:
    """Measure each patch of a body as `in_own_box` does."""
    found: dict[int, BoxDistortion] = {}
    for group in as_body(body).groups:
        found |= zip(group.numbers.tolist(), _in_own_boxes(group), strict=True)
    return tuple(found[number] for number in range(len(found)))


def _in_own_boxes(group: PatchGroup) -> Iterator[BoxDistortion]:
    """Yield the distortion of each patch of a group."""
    rules, weights = _rules(group, _N_GAUSS)
    boxes = _own_boxes(group, rules, weights)
    mean, size = np.zeros((2, len(group)))
    largest, least = np.full(len(group), -np.inf), np.full(len(group), np.inf)
    for (rows, slab), jacobians in _slabs(group, rules):
        values = _arap(jacobians / boxes[rows, None, None, None, None], (1.0,))[0]
        mean[rows] += np.einsum("ijk,pijk->p", weights[slab], values)
        size[rows] += np.einsum("ijk,pijk->p", weights[slab], np.linalg.det(jacobians))
        largest[rows] = np.maximum(largest[rows], values.max(axis=(1, 2, 3)))
        least[rows] = np.minimum(least[rows], scaled_jacobian(jacobians).min(axis=(1, 2, 3)))
    for (a, b, c), volume, *arap, ratio in zip(
        *map(np.ndarray.tolist, (boxes, size, mean, largest, least)), strict=True
    ):
        yield BoxDistortion((a, b, c), volume, Distortion(*arap), ratio, weights.size)


def own_boxes(body: BodyLike) -> Array:
    """Return the sides (patches, 3) of each patch's own box: the mean lengths of F_u, F_v and F_w over the cube."""
    several = as_body(body)
    boxes = np.empty((len(several), 3))
    for group in several.groups:
        boxes[group.numbers] = _own_boxes(group, *_rules(group, _N_GAUSS))
    return boxes


def _own_boxes(group: PatchGroup, rules: Rules, weights: Array) -> Array:
    """Return the sides (k, 3) of the own boxes of the patches of a group from the values at the points of rules."""
    boxes = np.zeros((len(group), 3))
    for (rows, slab), jacobians in _slabs(group, rules):
        boxes[rows] += np.einsum("ijk,pijka->pa", weights[slab], np.linalg.norm(jacobians, axis=-2))
    return boxes


def _rules(group: PatchGroup, n_gauss: int) -> tuple[Rules, Array]:
    """Return the Gauss points and weights of each direction, and the weights (m_u, m_v, m_w) of all points."""
    rules = [gauss_points(k, n_gauss) for k in group.knots]
    return rules, np.einsum("i,j,k->ijk", *(weights.ravel() for _, weights in rules))


def _slabs(group: PatchGroup, rules: Rules) -> Iterator[tuple[tuple[slice, slice], Array]]:
    """Yield the Jacobians (patches, rows, m_v, m_w, 3, 3) at the points of rules part by part: it bounds the memory.

    Each part comes with its patches and its slab of rows along u. Left-handed patches are mirrored in x.
    """
    u, v, w = (points.ravel() for points, _ in rules)
    together = max(1, _SLAB_POINTS // (len(u) * len(v) * len(w)))
    step = max(1, _SLAB_POINTS // (len(v) * len(w)))
    for begin, part in zip(range(0, len(group), together), group.divided(together), strict=True):
        rows = slice(begin, begin + together)
        hands = orientations(group)[rows]
        for start in range(0, len(u), step):
            jacobians = part.grid_jacobian(u[start : start + step], v, w)
            yield (rows, slice(start, start + step)), unmirrored(jacobians, hands)


def arap_on(volume: BSplineVolume, u: ArrayLike, v: ArrayLike, w: ArrayLike, box: ArrayLike = 1.0) -> Array:
    """Return the ARAP distortion of the map from a box on a tensor grid: (len(u), len(v), len(w)).

    box: its sides (3,), or the length of all three. A left-handed volume is as distorted as its mirror image.
    """
    jacobians = unmirrored(volume.grid_jacobian(u, v, w)[None], np.array([orientation(volume)]))
    return in_boxes(jacobians, np.broadcast_to(box, (1, 3)))[0]


def in_boxes(jacobians: Array, boxes: Array) -> Array:
    """Return the ARAP distortion (k, ...) of maps from boxes with sides (k, 3), of Jacobians (k, ..., 3, 3)."""
    return _arap(jacobians / boxes.reshape(len(boxes), *(1,) * (jacobians.ndim - 2), 3), (1.0,))[0]


def unmirrored(jacobians: Array, hands: IntArray) -> Array:
    """Return Jacobians (k, ..., 3, 3) of patches with orientations (k,), of left-handed ones of their mirror images.

    The mirror image is that in x, whose det J is the negative of the patch's, exactly. The given array is changed.
    """
    jacobians[..., 0, :] *= hands.reshape(-1, *(1,) * (jacobians.ndim - 2))
    return jacobians


def arap(jacobians: ArrayLike) -> Array:
    """Return the as-rigid-as-possible distortion sum (sigma_i - 1)^2, sigma_3 signed like det: (..., 3, 3) -> (...).

    (Paper, section 3.2, which leaves the sign open: with it the mirror image of a rigid map costs 4, not 0.)
    Raises ValueError for another shape or entries that are not finite.
    """
    matrices = np.asarray(jacobians, dtype=np.float64)
    if matrices.shape[-2:] != (3, 3):
        raise ValueError(f"jacobians must have shape (..., 3, 3), got {matrices.shape}")
    if not np.all(np.isfinite(matrices)):
        raise ValueError("jacobians must be finite")
    return _arap(matrices, (1.0,))[0]


def _arap(jacobians: Array, scales: tuple[float, ...]) -> list[Array]:
    """Return the distortion of scale * J for each scale: the squared distance to the rotation closest to J."""
    columns = np.ascontiguousarray(np.moveaxis(jacobians.reshape(-1, 3, 3), 0, -1))
    rotations = closest_rotations(columns)
    values = [((scale * columns - rotations) ** 2).sum(axis=(0, 1)) for scale in scales]
    return [value.reshape(jacobians.shape[:-2]) for value in values]


def scaled_jacobian(jacobians: ArrayLike) -> Array:
    """Return det J over the product of its columns' lengths, -1 to 1, 0 where one vanishes: (..., 3, 3) -> (...)."""
    matrices = np.asarray(jacobians, dtype=np.float64)
    lengths = np.linalg.norm(matrices, axis=-2, keepdims=True)
    units = np.divide(matrices, lengths, out=np.zeros_like(matrices), where=lengths > 0.0)
    return np.linalg.det(units)
