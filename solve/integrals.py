"""Integrals over a body, or over the images of the cube's faces: volume, mass, averages, resultants."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array
from parameterize.spline.bspline import gauss_points
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .field import Points
from .forms.form import Quantity
from .forms.frame import face_geometry
from .quantities import grid_values, quantity_of, slabs
from .solution import Solution

Integrand = Quantity | Callable[[Points], ArrayLike]


def integrate(
    body: BSplineVolume | Solution,
    what: str | Integrand | None = None,
    over: str | Sequence[str] | None = None,
) -> Array:
    """Return an integral over a body or over faces of it, in the units of the volume: a number or an array (...).

    Parameters
    ----------
    body : BSplineVolume or Solution
        What is integrated over.
    what : str or function, optional
        Nothing for 1, so that the integral is the volume or the area. Of a solution the name of a quantity, as in
        `Solution.quantity`, or a function of u (c, ...), grad (c, 3, ...) and x (3, ...). Of a volume a function of x.
    over : str or list of str, optional
        Names of faces, "u0" to "w1"; the whole body by default.

    Raises
    ------
    TypeError
        For what is no volume or solution.
    ValueError
        For a name that the law does not give, a face that there is not, and a function that fails or has another shape.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"))
    >>> volume, area = iga_nn.integrate(solution), iga_nn.integrate(solution, over=["u0", "u1"])
    >>> mean = iga_nn.integrate(solution, "u")[0] / volume
    >>> bool(0.1 < mean < 0.2)
    True
    """
    if not isinstance(body, BSplineVolume | Solution):
        raise TypeError(f"body must be a volume or a solution, got {body!r:.80}")
    volume = body if isinstance(body, BSplineVolume) else body.geometry
    rules = _rules(body)
    rows, weights = [points for points, _ in rules], [weight for _, weight in rules]
    faces = None if over is None else _faces(over)
    if faces is None:
        total: Array | float = 0.0
        start = 0
        for u in slabs(*rows):
            det = np.abs(np.linalg.det(volume.grid_jacobian(u, *rows[1:])))
            measure = np.einsum("i,j,k,ijk->ijk", weights[0][start : start + len(u)], *weights[1:], det)
            total = total + _sum(_integrand(body, what, u, *rows[1:]) * measure)
            start += len(u)
        return np.asarray(total)
    return np.asarray(sum(_over_face(body, volume, what, rows, weights, *face) for face in faces))


def resultant(solution: Solution, over: str | Sequence[str]) -> Array:
    """Return the integral of a law's flux through faces, outward (c,): of elasticity the force that acts on the body.

    The flux is a derivative of the solution, so its integral is less accurate than a solution's values.

    Parameters
    ----------
    solution : Solution
        Of any law.
    over : str or list of str
        Names of faces, "u0" to "w1".

    Raises
    ------
    ValueError
        For a face that there is not.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x"))
    >>> faces = ("u0", "u1", "v0", "v1", "w0", "w1")
    >>> bool(abs(iga_nn.resultant(solution, faces)[0]) < 1e-8)  # as much goes in as out
    True
    """
    if not isinstance(solution, Solution):
        raise TypeError(f"a resultant is that of a solution, got {solution!r:.80}")
    rules = _rules(solution)
    rows, weights = [points for points, _ in rules], [weight for _, weight in rules]
    flux = quantity_of(solution.problem.form, "flux")
    total = np.zeros(solution.problem.form.components)
    for axis, side in _faces(over):
        single = [np.array([float(side)]) if a == axis else row for a, row in enumerate(rows)]
        values = np.squeeze(grid_values(solution, flux, *single), 2 + axis)  # (c, 3, q_b, q_c)
        _, area = face_geometry(solution.geometry, rows, axis, side)
        b, c = (weights[a] for a in range(3) if a != axis)
        total += np.einsum("cdij,dij,i,j->c", values, area, b, c)
    return total


def _rules(body: BSplineVolume | Solution) -> list[tuple[Array, Array]]:
    """Return Gauss points and weights a direction: exact for the volume, and as fine as the errors' of a solution."""
    found = []
    volume = body if isinstance(body, BSplineVolume) else body.geometry
    for axis, knots in enumerate(body.knots):
        count = max((3 * volume.degrees[axis] + 1) // 2, body.degrees[axis] + 2)
        points, weights = gauss_points(knots, count)
        found.append((points.ravel(), weights.ravel()))
    return found


def _faces(over: str | Sequence[str]) -> list[tuple[int, int]]:
    """Return axis and side of each face. Raises ValueError for a name that there is not, and for no names."""
    if not over or not isinstance(over, str | Sequence | set):
        raise ValueError(f"over: give names of faces, {', '.join(FACE_NAMES)}; got {over!r:.80}")
    names = [over] if isinstance(over, str) else list(over)
    for name in names:
        if name not in FACE_NAMES:
            raise ValueError(f"over: {name!r} is no face of the cube; the faces are {', '.join(FACE_NAMES)}")
    return [divmod(FACE_NAMES.index(name), 2) for name in dict.fromkeys(names)]


def _integrand(body: BSplineVolume | Solution, what: str | Integrand | None, u: Array, v: Array, w: Array) -> Array:
    """Return what is integrated (..., n_u, n_v, n_w) on a grid."""
    if what is None:
        return np.ones((len(u), len(v), len(w)))
    if not isinstance(body, BSplineVolume):
        return grid_values(body, quantity_of(body.problem.form, what), u, v, w)  # type: ignore[arg-type]
    if isinstance(what, str):
        raise ValueError(f"a volume alone has no {what!r}: give a function of x, or a solution in its place")
    if not callable(what):
        raise ValueError(f"what must be a function or nothing, got {what!r:.80}")
    x = Points.on(body, u, v, w)
    try:
        found = np.asarray(what(x), dtype=np.float64)  # type: ignore[call-arg]
    except Exception as error:  # whatever a user's function does
        raise ValueError(f"the function of x fails: {type(error).__name__}: {error}") from error
    if found.ndim == 0:
        return np.broadcast_to(found, x.shape[1:])
    if found.shape[-3:] != x.shape[1:]:
        raise ValueError(f"the function must return an array (..., {', '.join(map(str, x.shape[1:]))})")
    return found


def _over_face(
    body: BSplineVolume | Solution,
    volume: BSplineVolume,
    what: str | Integrand | None,
    rows: Sequence[Array],
    weights: Sequence[Array],
    axis: int,
    side: int,
) -> Array:
    """Return the integral over a face."""
    u, v, w = (np.array([float(side)]) if a == axis else row for a, row in enumerate(rows))
    _, area = face_geometry(volume, rows, axis, side)
    b, c = (weights[a] for a in range(3) if a != axis)
    measure = np.linalg.norm(area, axis=0) * np.multiply.outer(b, c)
    return _sum(_integrand(body, what, u, v, w) * np.expand_dims(measure, axis))


def _sum(values: Array) -> Array:
    """Return the sum over the three last axes."""
    return np.asarray(values.sum(axis=(-3, -2, -1)))
