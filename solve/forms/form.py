"""Defines Form: the law of a linear second-order PDE, from which the solver derives everything else."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from parameterize.arrays import Array

from .data import demand_definite
from .jets import PAIRS, SYMMETRIC, Jet, Number, coordinates, stacked

Quantity = Callable[[Any, Any, Any], Any]  # of u (c, ...), grad (c, 3, ...) and x (3, ...)

ROUNDING = 1e-8  # share of a law's size by which it may differ from a linear or symmetric one


class Form:
    """The law of -div flux(u) + react(u) = f, in weak form

        int flux : grad v + react . v  =  int f . v  +  int_boundary (flux . n) . v    for all tests v.

    Subclass it and write `flux`, and `react` where there is one. Both take NumPy arrays or arrays of jets
    (`forms.jets`), whose dimensions (...) are none: then the source of an exact solution and the estimate of the error
    follow. Use arithmetic, indices, `np.stack` and sin, cos, tan, exp, log, sqrt, tanh and abs.

    Attributes
    ----------
    components : int
        c, of u; 1 by default.
    symmetric : bool
        Whether conjugate gradients solve it; else GMRES does. True by default.
    linear : bool
        Whether flux and reaction are linear in u and its gradient; else `iga_nn.newton` solves it, and `symmetric`
        speaks of the law's derivative. True by default.
    constant : bool
        Whether the flux has neither u nor x in it, and there is no reaction: products are then faster, and `flux` may
        get None for x. False by default.
    has_large_strains : bool
        Whether forces act where the body has gone, so that moments are those of the moved body. False by default.
    history : int
        Number of internal variables at a point, which `x.state` (history, ...) has in `flux`, or None before the first
        load step; `advanced` returns those at the end of a step. 0 by default.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> class Wind(iga_nn.Form):
    ...     symmetric = False
    ...     def flux(self, u, grad, x):  # u (1, ...), grad (1, 3, ...), x (3, ...)
    ...         return 0.1 * grad
    ...     def react(self, u, grad, x):
    ...         return grad[:, 0]  # carried along x
    >>> iga_nn.solve(benchmark_volume(2), iga_nn.Problem(Wind(), exact="x*y")).report.converged
    True
    """

    components: int = 1
    symmetric: bool = True
    linear: bool = True
    has_large_strains: bool = False
    constant: bool = False
    history: int = 0

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the flux (c, 3, ...) of u (c, ...) and its gradient (c, 3, ...) at points x (3, ...).

        It is linear in u and the gradient, unless `linear` says otherwise.
        """
        raise NotImplementedError(f"{type(self).__name__} must define flux(self, u, grad, x)")

    def react(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the term (c, ...) of u and grad that is multiplied by the test function itself; 0 by default."""
        return 0.0

    def initial_flux(self, x: Any) -> Any:
        """Return the flux (c, 3, ...) of a body at rest, u = 0, at points x (3, ...), such as a thermal stress.

        `flux` is linear beside it: the whole flux is the sum of the two.
        """
        raise NotImplementedError(f"{type(self).__name__} has no initial flux")

    @property
    def has_initial_flux(self) -> bool:
        """Return whether the law has an initial flux."""
        return type(self).initial_flux is not Form.initial_flux

    def whole_flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the flux (c, 3, ...) with the initial one; arguments as of `flux`."""
        found = self.flux(u, grad, x)
        return found + self.initial_flux(x) if self.has_initial_flux else found

    def energy(self, u: Any, grad: Any, x: Any) -> Any:
        """Return half of flux : grad u + react . u, (...), whose integral is the energy 1/2 a(u, u) of the body."""
        inside = (np.asarray(self.flux(u, grad, x)) * grad).sum(axis=(0, 1))
        return 0.5 * (inside + (reaction(self, u, grad, x) * u).sum(axis=0))

    def tangent(self, u: Any, grad: Any, x: Any) -> Array | None:
        """Return the derivative (c, 4, c, 4, ...) of a law that is not linear, as `tangent.derivative` has it.

        None, the default, stands for the derivative by jets.
        """
        return None

    def advanced(self, grad: Array, x: Any) -> Array:
        """Return the internal variables (history, ...) at the end of a load step with gradients (c, 3, ...)."""
        raise NotImplementedError(f"{type(self).__name__} has a history and must define advanced(self, grad, x)")

    def shown(self, grad: Array, x: Any) -> Array:
        """Return what solutions know in place of the history (history, ...) between Gauss points, as `x.state`.

        By default it is the history. Splines are fitted to it, so that it should be smooth.
        """
        return np.asarray(x.state, dtype=np.float64)

    @property
    def bounded(self) -> Sequence[int]:
        """Return which of the variables of `shown` must stay, on each patch, between those at its Gauss points."""
        return ()

    @property
    def caveat(self) -> str:
        """Return why the law takes many iterations and has no error estimate from the residual; "" otherwise."""
        return ""

    def free_motions(self, x: Array) -> Array:
        """Return the motions (k, c, m) at points x (3, m) that a vector law does not resist; none by default."""
        return np.zeros((0, self.components, x.shape[1]))

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Return the quantities of a solution of this law, by name; a subclass may add some.

        `magnitude` is the length of u, `gradient_magnitude` and `flux_magnitude` are the lengths of gradient and flux.
        """
        return {
            "u": lambda u, grad, x: u,
            "gradient": lambda u, grad, x: grad,
            "flux": self.whole_flux,
            "magnitude": lambda u, grad, x: np.sqrt((u * u).sum(axis=0)),
            "gradient_magnitude": lambda u, grad, x: _length(grad),
            "flux_magnitude": lambda u, grad, x: _length(self.whole_flux(u, grad, x)),
        }

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names of quantities with one number a point whose extremes a report shows."""
        return ("u" if self.components == 1 else "magnitude", "gradient_magnitude", "flux_magnitude")

    @property
    def has_reaction(self) -> bool:
        """Return whether the law has a term `react`."""
        return type(self).react is not Form.react

    def tensor(self, x: Array, component: int = 0) -> Array:
        """Return the symmetric tensor (6, ...) from a component's gradient to its flux: xx, xy, xz, yy, yz, zz.

        Raises ExpressionError where it is not positive definite: there the law is not coercive.
        """
        unit = np.zeros((3, self.components, 3, *x.shape[1:]))
        for i in range(3):
            unit[i, component, i] = 1.0
        rows = [self.flux(np.zeros_like(unit[i, :, 0]), unit[i], x)[component] for i in range(3)]
        tensor = np.stack([0.5 * (rows[i][j] + rows[j][i]) for i, j in PAIRS])
        demand_definite(tensor, f"the factor from grad to {type(self).__name__}.flux", x)
        return tensor

    def mass(self, x: Array, component: int = 0) -> Array:
        """Return the factor (...) from a component to its reaction."""
        unit = np.zeros((self.components, *x.shape[1:]))
        unit[component] = 1.0
        return reaction(self, unit, np.zeros((self.components, 3, *x.shape[1:])), x)[component]

    def matrix_along(self, wave: Array, x: Array) -> Array:
        """Return the symmetric part (..., c, c) of the matrix from d to flux(d (x) k) . k, for vectors k (3, ...)."""
        columns = []
        for d in range(self.components):
            unit = np.zeros((self.components, *wave.shape[1:]))
            unit[d] = 1.0
            flux = np.asarray(self.flux(np.zeros_like(unit), unit[:, None] * wave, x), dtype=np.float64)
            columns.append((flux * wave).sum(axis=1))
        return _symmetric(columns)

    def matrix_of_wave(self, wave: Array, x: Array) -> Array:
        """Return the symmetric part (..., c, c) by which the law multiplies waves d exp(i k . x), k (3, ...)."""
        matrix = self.matrix_along(wave, x)
        if self.has_reaction:
            units = np.eye(self.components).reshape(self.components, -1, *(1,) * (wave.ndim - 1))
            none = np.zeros((self.components, 3, *wave.shape[1:]))
            ones = np.ones(wave.shape[1:])
            matrix = matrix + _symmetric([reaction(self, unit * ones, none, x) for unit in units])
        return matrix

    def symbol(self, wave: Array, x: Array) -> Array:
        """Return the least factor (...) by which the law multiplies waves exp(i k . x) with wave vectors k (3, ...)."""
        matrix = self.matrix_of_wave(wave, x)
        least = matrix[..., 0, 0] if self.components == 1 else np.linalg.eigvalsh(matrix)[..., 0]
        return np.asarray(least, dtype=np.float64)


def _symmetric(columns: Sequence[Array]) -> Array:
    """Return the symmetric part (..., c, c) of matrices whose columns are c arrays (c, ...)."""
    matrix: Array = np.moveaxis(np.stack(columns), (0, 1), (-2, -1))
    return 0.5 * (matrix + matrix.swapaxes(-1, -2))


def reaction(form: Form, u: Array, grad: Array, x: Array) -> Array:
    """Return a law's reaction as an array (c, ...), also where the law returns a number."""
    return np.broadcast_to(np.asarray(form.react(u, grad, x), dtype=np.float64), u.shape)


def strong_terms(form: Form, u: Sequence[Jet], x: Array) -> list[list[Number]]:
    """Return for each of c functions the terms of -div flux + react at points x (3, ...): arrays (...) or numbers.

    u: the functions as jets with second derivatives.
    """
    values = as_objects([Jet(jet.value, jet.gradient, ()) for jet in u], (len(u),))
    slopes = [
        Jet(jet.gradient[i], tuple(jet.hessian[place] for place in SYMMETRIC[i]), ()) for jet in u for i in range(3)
    ]
    grad, where = as_objects(slopes, (len(u), 3)), as_objects(coordinates(x), (3,))
    with np.errstate(all="ignore"):
        flux = np.asarray(form.whole_flux(values, grad, where), dtype=object)
        react = np.broadcast_to(np.asarray(form.react(values, grad, where), dtype=object), values.shape)
    if flux.shape != grad.shape:
        raise ValueError(f"flux must return shape {grad.shape} on jets of that shape, got {flux.shape}")
    found = []
    for row, last in zip(flux, react, strict=True):
        terms = [-entry.gradient[i] for i, entry in enumerate(row) if isinstance(entry, Jet)]
        found.append([*terms, last.value if isinstance(last, Jet) else last])
    return found


def strong_form(form: Form, u: Sequence[Jet], x: Array) -> Array:
    """Return -div flux + react (c, ...); arguments as in `strong_terms`."""
    return stacked([sum(terms) for terms in strong_terms(form, u, x)], x.shape[1:])


def as_objects(jets: Sequence[Jet], shape: tuple[int, ...]) -> Any:
    """Return jets as an array of objects of the given shape."""
    array = np.empty(len(jets), dtype=object)
    array[:] = jets
    return array.reshape(shape)


class LawError(ValueError):
    """Raised for a law that is not defined, or whose results on arrays have wrong shapes."""


def _results(form: Form, u: Array, grad: Array, x: Array) -> tuple[Array, Array]:
    """Return the flux (c, 3, m) and the reaction (c, m) of a law.

    Raises LawError where they have other shapes, ValueError where the law fails or they are not finite real numbers.
    """
    name, results = type(form).__name__, []
    for part, shape in (("flux", grad.shape), ("react", u.shape)):
        try:
            found = np.asarray(getattr(form, part)(u, grad, x))
        except NotImplementedError as error:
            raise LawError(str(error)) from None
        except Exception as error:  # whatever a user's law does with arrays
            raise ValueError(f"{name}.{part} fails: {type(error).__name__}: {error}") from error
        if found.shape != shape and (part == "flux" or found.shape != ()):
            raise LawError(f"{name}.{part} must return shape {shape} for u of shape {u.shape}, got {found.shape}")
        if found.dtype.kind not in "iuf" or not np.all(np.isfinite(found)):
            raise ValueError(f"{name}.{part} must return finite real numbers")
        results.append(np.broadcast_to(found, shape))
    return results[0], results[1]


def _length(values: Array) -> Array:
    """Return the length (...) of gradients or fluxes (c, 3, ...)."""
    return np.asarray(np.sqrt((values * values).sum(axis=(0, 1))))


def check_shapes(form: Form) -> None:
    """Raise LawError for a law whose results have wrong shapes.

    A law that needs more than plain arrays is not judged.
    """
    c, m = form.components, 5
    try:
        _results(form, np.ones((c, m)), np.ones((c, 3, m)), np.ones((3, m)))
    except LawError:
        raise
    except Exception:  # whatever a user's law does with arrays
        return


def check_law(form: Form, x: Array) -> bool:
    """Check a law on random arguments at points x (3, m), and return whether it couples u with its gradient.

    Raises ValueError where the law's results have wrong shapes, are not linear, or are not symmetric although
    `symmetric` says so, and where a wave has no positive energy (the Legendre-Hadamard condition), for which no solver
    works.
    """
    c, m, name = form.components, x.shape[1], type(form).__name__
    if not form.linear:
        raise ValueError(f"{name} is not linear: iga_nn.newton solves it")
    rng = np.random.default_rng(0)
    (u, v), (p, q) = rng.standard_normal((2, c, m)), rng.standard_normal((2, c, 3, m))

    def law(u: Array, grad: Array) -> tuple[Array, Array]:
        return _results(form, u, grad, x)

    one, two, both = law(u, p), law(v, q), law(2.0 * u - 3.0 * v, 2.0 * p - 3.0 * q)
    for part, a, b, mixed in zip(("flux", "react"), one, two, both, strict=True):
        if np.abs(mixed - (2.0 * a - 3.0 * b)).max() > ROUNDING * np.abs([a, b]).max():
            raise ValueError(
                f"{name}.{part} must be linear in u and grad; else set `linear = False`, and iga_nn.newton solves it"
            )
    energies = [(a[0] * grad).sum((0, 1)) + (a[1] * w).sum(0) for a, grad, w in ((one, q, v), (two, p, u))]
    if form.symmetric and np.abs(energies[0] - energies[1]).max() > ROUNDING * np.abs(energies).max():
        raise ValueError(f"{name} is not symmetric: set `symmetric = False`, and GMRES solves it")
    if form.constant:
        try:
            is_constant = np.array_equal(form.flux(v, p, None), one[0]) and not form.has_reaction
        except TypeError:  # None has no entries
            is_constant = False
        if not is_constant:
            raise ValueError(f"{name} is not constant: leave u, x and react out, or set `constant = False`")
    wave = v[:, None] * q[0]
    if not np.all((law(0.0 * u, wave)[0] * wave).sum((0, 1)) > 0.0):
        raise ValueError(f"{name}.flux must be coercive: flux : grad must be positive for a gradient that is not zero")
    return bool(np.abs(law(u, 0.0 * p)[0]).max() > 0.0 or np.abs(law(0.0 * u, p)[1]).max() > 0.0)
