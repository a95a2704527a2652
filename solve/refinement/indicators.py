"""Measures, for each element and direction, the energy of what a raised solution has and the trial space cannot hold.

The raised solution u+ has one degree more, on the breakpoints of the trial space or on more. In direction d,
(I - P_d) u+ is the part that splines of the trial space along d do not hold. Its energy says what halving spans of d
gains: around an edge the two directions across it have much, and the one along it has none. P_d is the projection in
the H1 seminorm of one dimension, which keeps the values at both ends: the part is continuous across interfaces.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import breakpoints, collocation, gauss_points

from ..discretization import group_kernels
from ..discretization.quadrature import gauss_rule
from ..discretization.space import TrialSpace, of_each
from ..discretization.stack import PatchStack, Piece, Stacked, of_law, of_patches, stacks_of
from ..forms.form import Form, reaction
from ..patch_system import PatchProblem

Row = tuple[float, ...]  # knots
Elements = list[Array]  # of each patch (3, e_u, e_v, e_w): a number for each direction and element


def directional_energies(
    patches: Sequence[PatchProblem], raised: Sequence[TrialSpace], coefficients: Sequence[Array], threads: int = 1
) -> Elements:
    """Return the energies (3, e_u, e_v, e_w) on each patch of what its trial space cannot hold, for each direction.

    patches: with their trial spaces, whose elements are meant. raised: the raised spaces. coefficients: those of the
    raised solution, (c, n_u, n_v, n_w) each.
    """
    found = [np.zeros((3, *(len(row) - 1 for row in patch.space.breaks))) for patch in patches]
    own = [patch.space for patch in patches]
    for axis in range(3):
        spaces, missing = _missing(axis, own, raised, coefficients)
        parts = zip(found, energies(patches, spaces, missing, threads), spaces, own, strict=True)
        for elements, fine, space, coarse in parts:
            elements[axis] = _on_elements(fine, space.breaks, coarse.breaks)
    return found


def energies(
    patches: Sequence[PatchProblem], spaces: Sequence[TrialSpace], coefficients: Sequence[Array], threads: int = 1
) -> list[Array]:
    """Return the energy (e_u, e_v, e_w) on each element of each patch of a function on a body.

    patches: with their laws. spaces: those of the coefficients (c, n_u, n_v, n_w), on any breakpoints.
    """
    rules = of_each(lambda space: gauss_rule(space, space.degrees), spaces)
    stacked = [
        Stacked(patch.volume, space, rule, patch.problem.in_volume)
        for patch, space, rule in zip(patches, spaces, rules, strict=True)
    ]
    found = [np.empty(0)] * len(patches)
    for numbers, stack in stacks_of(stacked, threads):
        fields = np.ascontiguousarray(np.stack([coefficients[number] for number in numbers]))
        forms = [patches[number].problem.form for number in numbers]
        for number, own in zip(numbers, _energies(stack, fields, forms), strict=True):
            found[number] = own
    return found


def _missing(
    axis: int, spaces: Sequence[TrialSpace], raised: Sequence[TrialSpace], coefficients: Sequence[Array]
) -> tuple[list[TrialSpace], list[Array]]:
    """Return for each patch the space with the smallest splines along an axis that hold both, and the part in it."""
    alike: dict[Any, list[int]] = defaultdict(list)
    for number, (low, high) in enumerate(zip(spaces, raised, strict=True)):
        alike[low.key, high.key].append(number)
    found, parts = list(raised), [np.empty(0)] * len(raised)
    for numbers in alike.values():
        low, high = spaces[numbers[0]], raised[numbers[0]]
        row, matrix = beyond(
            tuple(low.knots[axis].tolist()), low.degrees[axis], tuple(high.knots[axis].tolist()), high.degrees[axis]
        )
        knots: Any = tuple(row if own == axis else known for own, known in enumerate(high.knots))
        space = replace(high, knots=knots)
        moved = np.moveaxis(np.stack([coefficients[number] for number in numbers]), 2 + axis, -1)
        for number, part in zip(numbers, np.moveaxis(moved @ matrix.T, -1, 2 + axis), strict=True):
            found[number], parts[number] = space, part
    return found, parts


@lru_cache(maxsize=512)
def beyond(low: Row, degree: int, high: Row, raised: int) -> tuple[Array, Array]:
    """Return a knot vector of the raised degree, and the matrix of I - P from splines on `high` to splines on it.

    P projects on splines of the lower degree on `low`: the value at the first end stays, and the slope is the nearest
    in L2. The knot vector is the smallest one whose splines hold those of both.
    """
    below, above = np.array(low), np.array(high)
    both = _in_common(below, above, raised - degree)
    points, weights = (row.ravel() for row in gauss_points(both, raised + 1))
    roots = np.sqrt(weights)[:, None]
    tables = ((below, degree), (above, raised), (both, raised))
    (low_values, low_slopes), (values, slopes), (wanted, _) = (
        [roots * collocation(row, p, points, order).toarray() for order in (0, 1)] for row, p in tables
    )
    chosen = np.zeros((low_slopes.shape[1], slopes.shape[1]))
    chosen[0, 0] = 1.0  # the value at the first end is the first coefficient
    chosen[1:] = np.linalg.lstsq(low_slopes[:, 1:], slopes - low_slopes[:, :1] * chosen[0])[0]
    return both, np.linalg.lstsq(wanted, values - low_values @ chosen)[0]


def _in_common(low: Array, high: Array, more: int) -> Array:
    """Return the knots with the larger multiplicity of two rows, of which the first is raised by `more` degrees."""
    values, repeats = np.unique(high, return_counts=True)
    own, count = np.unique(low, return_counts=True)
    places = np.searchsorted(values, own)
    repeats[places] = np.maximum(repeats[places], count + more)
    return np.repeat(values, repeats)


def _energies(stack: PatchStack, fields: Array, forms: Sequence[Form]) -> Array:
    """Return the energies (k, e_u, e_v, e_w) of fields (k, c, n_u, n_v, n_w) on the spans of the stack's rules."""
    counts = stack.space.degrees
    u, v, w = (n // count for n, count in zip(stack.shape, counts, strict=True))
    found = np.zeros((len(stack), u, w, v))

    def integrate(piece: Piece) -> None:
        patches, _ = piece
        shape = len(patches), fields.shape[1]
        values, slopes = np.empty((*shape, 4, *stack.plane_shape)), np.empty((*shape, 3, *stack.plane_shape))
        form = forms[patches[0]]
        for q, rows, measure, x in stack.geometry(piece):
            group_kernels.evaluate_splines(fields, patches, stack.kinds[patches], q, stack.tables, values)
            group_kernels.turn_fields(rows, values[:, :, 1:], slopes, False)  # times the root of the measure
            root = np.sqrt(np.abs(measure))[:, None]
            density = of_patches(_density(form, of_law(values[:, :, 0] * root), of_law(slopes), x), measure)
            found[patches, q // counts[0]] += density.reshape(-1, w, counts[2], v, counts[1]).sum(axis=(2, 4))

    stack.on_pieces(integrate)
    return np.swapaxes(found, 2, 3)


def _density(form: Form, u: Array, grad: Array, x: Any) -> Array:
    """Return the energy (...) of a field (c, ...) with its gradient (c, 3, ...)."""
    density = (np.asarray(form.flux(u, grad, x)) * grad).sum(axis=(0, 1))
    if form.has_reaction:
        density = density + (reaction(form, u, grad, x) * u).sum(axis=0)
    return np.asarray(density)


def _on_elements(energies: Array, fine: Knots, coarse: Knots) -> Array:
    """Return sums of energies (e_u, e_v, e_w) between fine breakpoints over the elements of the coarse ones."""
    for axis, (own, wanted) in enumerate(zip(fine, coarse, strict=True)):
        energies = np.add.reduceat(energies, np.searchsorted(own, breakpoints(wanted)[:-1]), axis=axis)
    return energies


def along_directions(elements: Elements) -> list[tuple[Array, Array, Array]]:
    """Return for each patch the sums (e_u,), (e_v,), (e_w,) over the slabs of spans, for each direction of its own."""
    return [(own[0].sum(axis=(1, 2)), own[1].sum(axis=(0, 2)), own[2].sum(axis=(0, 1))) for own in elements]
