"""Integrates over a body, or over regions of its boundary: volume, mass, areas, averages, resultants."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.bspline import breakpoints, gauss_points
from parameterize.spline.orientation import FACES, exact_points, orientations
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .discretization.space import TrialSpace, same_smoothness
from .discretization.surface_rule import Faces, SurfaceRule, surface_rules
from .field import Points, SplineField
from .forms.form import Quantity
from .forms.frame import UnitFrame
from .forms.region import FacesOfPoints, Region, Regions, regions_of, tolerances
from .quantities import at_points, grid_values, quantity_of, slabs, volume_of
from .solution import PatchSolution, Solution

Integrand = Quantity | Callable[[Points], ArrayLike]
Patch = BSplineVolume | SplineField  # a field with its volume
Domain = BodyLike | PatchSolution | Solution


def integrate(
    body: Domain,
    what: str | Integrand | None = None,
    over: Regions | None = None,
) -> Array:
    """Return an integral over a body or over regions of its boundary, in the units of the volume: a number or (...).

    Parameters
    ----------
    body : BSplineVolume, Body or Solution
        The domain of the integral.
    what : str or function, optional
        The integrand; by default 1, so that the integral is the volume or the area. For a solution the name of a
        quantity, as in `Solution.quantity`, or a function of u (c, ...), grad (c, 3, ...) and x (3, ...). For a volume
        a function of x.
    over : Region, str or list of these, optional
        Regions of the boundary (`Region`, or its text), as "nz > 0.9" or "u0"; an overlap of several counts once.
        The whole body by default. The area is right to 1e-4 where a region ends inside a face of the cube.

    Raises
    ------
    TypeError
        For an object that is no volume or solution.
    ValueError
        For a name that the law does not have, a region that is refused or has no area, and a function that fails or has
        another shape.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"))
    >>> volume, area = iga_nn.integrate(solution), iga_nn.integrate(solution, over="nz > 0.9 or nz < -0.9")
    >>> mean = iga_nn.integrate(solution, "u")[0] / volume
    >>> bool(0.1 < mean < 0.2)
    True
    """
    if not isinstance(body, Domain):
        raise TypeError(f"body must be a volume or a solution, got {body!r:.80}")
    if over is None:
        return np.asarray(sum(_over_patch(patch, what) for patch in _patches(body)))
    total: Array | float = 0.0
    for patch, rule in _surface_rules(body, over):
        total = total + np.tensordot(rule.weights, _at_points(patch, what, rule), axes=(0, 0))
    return np.asarray(total)


def resultant(solution: Solution, over: Regions) -> Array:
    """Return the integral of a law's flux through regions, outward (c,): of elasticity the force that acts on the body.

    The flux is a derivative of the solution, so its integral is less accurate than a solution's values. The reactions
    of supports in `solution.report.balance` are more accurate.

    Parameters
    ----------
    solution : Solution
        Solution of any law.
    over : Region, str or list of these
        Regions of the boundary, as in `integrate`.

    Raises
    ------
    ValueError
        For a region that is refused or has no area.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x"))
    >>> faces = ("u0", "u1", "v0", "v1", "w0", "w1")
    >>> bool(abs(iga_nn.resultant(solution, faces)[0]) < 1e-8)  # as much goes in as out
    True
    """
    if not isinstance(solution, Solution | PatchSolution):
        raise TypeError(f"a resultant is that of a solution, got {solution!r:.80}")
    total = np.zeros(solution.problem.form.components)
    for patch, rule in _surface_rules(solution, over):
        assert isinstance(patch, PatchSolution)
        flux = at_points(patch, patch.problem.form, "flux", rule.at.parameters)  # (m, c, 3)
        total += np.einsum("mcd,dm,m->c", flux, rule.at.normal, rule.weights)
    return total


def _patches(body: Domain) -> Sequence[Patch]:
    """Return the patches of a body, or the solutions on them."""
    if isinstance(body, PatchSolution):
        return (body,)
    return body.patches if isinstance(body, Solution) else as_body(body).patches


def _maps(body: Domain) -> Body:
    """Return the maps of a body or of a solution."""
    return body.on_body if isinstance(body, Solution | PatchSolution) else as_body(body)


def _volume_of(body: Patch) -> BSplineVolume:
    return body if isinstance(body, BSplineVolume) else volume_of(body)


def _counts(body: Patch) -> list[int]:
    """Return the numbers of Gauss points a span and direction: exact for a volume; of a solution, as for errors."""
    volume = _volume_of(body)
    spans = ([len(breakpoints(row)) - 1 for row in spline.knots] for spline in (body, volume))
    parts = [own // of_map for own, of_map in zip(*spans, strict=True)]
    return [max(of_map, own + 2) for of_map, own in zip(exact_points(volume, parts), body.degrees, strict=True)]


def _over_patch(body: Patch, what: str | Integrand | None) -> Array:
    """Return the integral (...) over a patch."""
    pairs = [gauss_points(knots, count) for knots, count in zip(body.knots, _counts(body), strict=True)]
    rows, weights = ([part.ravel() for part in parts] for parts in zip(*pairs, strict=True))
    total: Array | float = 0.0
    start = 0
    for u in slabs(*rows):
        det = np.abs(np.linalg.det(_volume_of(body).grid_jacobian(u, *rows[1:])))
        measure = np.einsum("i,j,k,ijk->ijk", weights[0][start : start + len(u)], *weights[1:], det)
        total = total + (_on_grid(body, what, u, *rows[1:]) * measure).sum(axis=(-3, -2, -1))
        start += len(u)
    return np.asarray(total)


def _surface_rules(body: Domain, over: Regions) -> Iterator[tuple[Patch, SurfaceRule]]:
    """Yield the quadrature rules, one an outer face, of the part of the boundary that is in one of the regions.

    Each rule comes with its patch. Raises ValueError where that part is empty.
    """
    patches = _patches(body)
    for number, rule in surface_rules_on(patches, _maps(body), _placed(body, over)):
        yield patches[number], rule


def surface_rules_on(
    patches: Sequence[Patch], body: Body, regions: Sequence[Region]
) -> Iterator[tuple[int, SurfaceRule]]:
    """Yield the rules of the part of the boundary in regions that are placed, each with the number of its patch.

    patches: of the body, or fields on these. Raises ValueError where that part is empty.
    """
    found = False
    length = None if body.is_single else UnitFrame.of(body).length
    needs_normal = any(region.needs_normal for region in regions)
    for faces, space in _outer_faces(patches, body):
        name = FACE_NAMES[2 * faces.axis + faces.side]
        names, near = [body.face_name(i, name) for i in faces.group.numbers.tolist()], tolerances(faces.nets)

        def codes(x: Array, normal: Array, owners: IntArray, names: Any = names, near: Any = near) -> IntArray:
            on = FacesOfPoints(names, owners, near[owners])
            return np.any([region.holds_on(x, normal, on) for region in regions], axis=0).astype(np.int64)

        rule = surface_rules(faces, space, codes, length, needs_normal)
        if rule is None:
            continue
        found = True
        for owner in np.unique(rule.at.owners):
            yield int(faces.group.numbers[owner]), rule.part(np.flatnonzero(rule.at.owners == owner))
    if not found:
        raise ValueError(
            f"over {', '.join(repr(str(region)) for region in regions)}: no part of the boundary lies there"
        )


def _outer_faces(patches: Sequence[Patch], body: Body) -> Iterator[tuple[Faces, TrialSpace]]:
    """Yield the outer faces of one name of patches that are alike, with a space that has the points of their rules."""
    for group in body.groups:
        hands = orientations(group)
        for face, (axis, side) in enumerate(FACES):
            found = defaultdict(list)
            for place in np.flatnonzero(~body.glued[group.numbers, face]).tolist():
                patch = patches[group.numbers[place]]
                found[patch.degrees, *(row.tobytes() for row in patch.knots)].append(place)
            for places in found.values():
                patch, own = patches[group.numbers[places[0]]], np.array(places)
                degree = max(_counts(patch)) - 1  # a rule has a point more
                rows = map(same_smoothness, patch.knots, patch.degrees, (degree,) * 3)
                u, v, w = rows
                yield Faces(group.rows(own), axis, side, hands[own]), TrialSpace((degree,) * 3, (u, v, w))


def _placed(body: Domain, over: Regions) -> list[Region]:
    """Return regions with X, Y, Z measured in the body, and with the surface of the solution's problem."""
    if not over or not isinstance(over, Region | str | list | tuple):
        raise ValueError(f"over: give regions, such as 'nz > 0.9' or 'u0', got {over!r:.80}")
    regions = regions_of(over)
    frame = UnitFrame.of(_maps(body)) if any(region.is_scaled for region in regions) else None
    conditions = body.problem.conditions if isinstance(body, Solution | PatchSolution) else ()
    surface = next((c.region.surface for c in conditions if c.region.surface is not None), None)
    return [region.placed(frame, surface) for region in regions]


def _on_grid(body: Patch, what: str | Integrand | None, u: Array, v: Array, w: Array) -> Array:
    """Return the values (..., n_u, n_v, n_w) of the integrand on a grid of parameters."""
    if what is not None and isinstance(body, PatchSolution):
        return grid_values(body, quantity_of(body.problem.form, what), u, v, w)  # type: ignore[arg-type]
    return _of_position(what, Points.on(_volume_of(body), u, v, w))


def _at_points(body: Patch, what: str | Integrand | None, rule: SurfaceRule) -> Array:
    """Return the values (m, ...) of the integrand at the points of a rule."""
    if what is not None and isinstance(body, PatchSolution):
        return at_points(body, body.problem.form, what, rule.at.parameters)  # type: ignore[arg-type]
    x = Points.at(np.ascontiguousarray(rule.at.x), rule.at.parameters)
    return np.moveaxis(_of_position(what, x), -1, 0)


def _of_position(what: str | Integrand | None, x: Points) -> Array:
    """Return the values (..., shape) at points x (3, shape) of an integrand that is a function of x, or 1.

    Raises ValueError for an object that is not a function, and for a function that fails or has another shape.
    """
    if what is None:
        return np.ones(x.shape[1:])
    if isinstance(what, str):
        raise ValueError(f"a volume alone has no {what!r}: give a function of x, or a solution in its place")
    if not callable(what):
        raise ValueError(f"what must be a function or nothing, got {what!r:.80}")
    try:
        found = np.asarray(what(x), dtype=np.float64)  # type: ignore[call-arg]
    except Exception as error:  # whatever a user's function does
        raise ValueError(f"the function of x fails: {type(error).__name__}: {error}") from error
    if found.ndim == 0:
        return np.broadcast_to(found, x.shape[1:])
    if found.shape[found.ndim - len(x.shape[1:]) :] != x.shape[1:]:
        raise ValueError(f"the function must return an array (..., {', '.join(map(str, x.shape[1:]))})")
    return found
