"""Solves the adjoint problem of a linear functional: which v-weighted residual changes the functional by how much.

The adjoint z_h of a functional J satisfies a(v, z_h) = J(v) for all v of the trial space. So J(u_h) is the load at z_h
where no values are given, and a change r of the residual changes J by r(z_h) (Becker, Rannacher, *Acta Numerica* 10,
2001). A symmetric law has the matrix and the preconditioner of its own solve.
"""

import math
from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import replace

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import basis_derivatives
from parameterize.threads import one_blas_thread

from ..discretization.groups import OnPatches
from ..discretization.space import TrialSpace
from ..field import BodyField
from ..mixed import MixedSystem, parted
from ..options import IterationOptions
from ..system import System
from .samples import Samples

TOLERANCE = 1e-4  # of the residual: an adjoint weighs what is small itself
POINTS = 2**14  # whose functions are evaluated at once
ORDERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))  # of the value and the slopes in the three parameters


def why_no_adjoint(system: System) -> str:
    """Return why the adjoint of a system is not solved for; "" where it is."""
    if not system.problem.form.symmetric:
        return "the law is not symmetric"
    return "several processes share the body" if len(system.unknowns.processes.shared(None)) > 1 else ""


def adjoint(system: System, samples: Samples, tolerance: float = TOLERANCE) -> BodyField:
    """Return the adjoint of a functional, a function of the trial space that is zero where values are given.

    Raises ValueError where `why_no_adjoint` says why.
    """
    return adjoint_of(system, right_of(system, samples), tolerance)


def adjoint_of(
    system: System, right: Array, tolerance: float = TOLERANCE, known: Sequence[Array] | None = None
) -> BodyField:
    """Return the adjoint of a functional whose values at the free functions are a vector (N,).

    known: the fixed coefficients (c, n_u, n_v, n_w) on each patch; zero by default.
    """
    if why := why_no_adjoint(system):
        raise ValueError(f"the adjoint is not solved for: {why}")
    rest = replace(system.at_rest(), right=right.reshape(system.right.shape))
    if known is not None:
        patches = zip(system.patches, known, strict=True)
        rest = replace(rest, patches=tuple(replace(patch, known=own) for patch, own in patches))
    with one_blas_thread():
        found = rest._iterate(IterationOptions(tolerance=tolerance))
    return rest.field(found.x)


def right_of(system: System, samples: Samples) -> Array:
    """Return the values (N,) of a functional at the free functions of a system.

    Where the problem leaves a constant open, they are those of J(v - mean of v).
    """
    if isinstance(system, MixedSystem):
        of_u, of_p = parted(spread(system, samples, 4))
        return np.append(system.unknowns.collect(of_u), system.pressures.transposed @ of_p.flat)
    right = system.unknowns.collect(spread(system, samples, system.problem.form.components))
    if system.is_open:
        of_one = system.mass.matvec(np.ones(right.size)).reshape(right.shape)
        right -= right.sum() / of_one.sum() * of_one
    return right.ravel()


def spread(system: System, samples: Samples, components: int) -> OnPatches:
    """Return the values (components, n_u, n_v, n_w) of a functional at the functions of all patches."""
    found = system.matrix.layout.empty(components)
    alike: dict[Hashable, list[int]] = defaultdict(list)
    for number, patch in enumerate(system.patches):
        alike[patch.space.key].append(number)
    for numbers in map(np.array, alike.values()):
        here = np.flatnonzero(np.isin(samples.patches, numbers))
        if not len(here):
            continue
        space = system.patches[numbers[0]].space
        own = np.zeros((len(numbers), components, math.prod(space.shape)))
        for start in range(0, len(here), POINTS):
            part = here[start : start + POINTS]
            owners = np.searchsorted(numbers, samples.patches[part])
            _add(_at_functions(system, samples, part, components), _functions(space, samples, part), owners, own)
        found.add(numbers, own.reshape(len(numbers), components, *space.shape))
    return found


def _at_functions(system: System, samples: Samples, points: IntArray, components: int) -> Array:
    """Return the weights (4, m, components) of the values and of the three slopes in the parameters at some points."""
    patches, places = samples.patches[points], samples.places[points]
    inverse = np.linalg.inv(system.body.jacobian(patches, places))  # (m, 3, 3): by parameter, then by direction
    rows, vectors = len(samples.of_u), len(samples.of_grad)
    found = np.zeros((4, len(points), components))
    found[0, :, :rows] = samples.of_u[:, points].T
    found[1:, :, :vectors] = np.einsum("mba,cam->bmc", inverse, samples.of_grad[:, :, points])
    return found


def _functions(space: TrialSpace, samples: Samples, points: IntArray) -> tuple[IntArray, Array]:
    """Return the numbers (m, k) of the functions that are not zero at points, and values and slopes (4, m, k)."""
    each = [
        basis_derivatives(knots, degree, samples.places[points, a], derivatives=1)
        for a, (knots, degree) in enumerate(zip(space.knots, space.degrees, strict=True))
    ]
    columns = [first[:, None] + np.arange(values.shape[-1]) for first, values in each]
    _, n_v, n_w = space.shape
    i, j, k = columns
    numbers = (i[:, :, None, None] * n_v + j[:, None, :, None]) * n_w + k[:, None, None, :]
    (_, u), (_, v), (_, w) = each
    values = [np.einsum("mi,mj,mk->mijk", u[a], v[b], w[c]) for a, b, c in ORDERS]
    return numbers.reshape(len(points), -1), np.stack(values).reshape(4, len(points), -1)


def _add(weights: Array, functions: tuple[IntArray, Array], owners: IntArray, result: Array) -> None:
    """Add weights (4, m, c) times functions to integrals (k, c, n) of the patches `owners` (m,)."""
    numbers, values = functions
    places = owners[:, None] * result.shape[-1] + numbers
    for component in range(result.shape[1]):
        density = np.einsum("sm,smk->mk", weights[:, :, component], values)
        total = np.bincount(places.ravel(), density.ravel(), len(result) * result.shape[-1])
        result[:, component] += total.reshape(len(result), -1)
