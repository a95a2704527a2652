"""Imposes conditions on regions of a face in weak form: values by Nitsche's method, loads and exchange.

Values u . d = h along directions d are held by Nitsche's symmetric method (Freund and Stenberg 1995), P the projector
on the directions, t = flux(u) . n:

    a(u, v) - int t(u) . P v - int t(v) . P u + int gamma P u . P v  =  ... - int t(v) . P g + int gamma P g . P v

docs/solver.md says how gamma keeps it coercive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import block_array, coo_array, csr_array, diags_array, eye_array, kron

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.volume import FACE_NAMES

from ..field import Points, part_of
from ..forms.form import Form
from .face_data import by_patches, on_layer

# Share of a component that is held: a plane face across another axis holds so little by rounding alone, and a patch
# among others that it seemed to hold would be inverted with an eigenvalue of either sign.
ROUNDING = 1e-12


OF_FACES = ("name", "patches", "form", "is_whole", "tables", "slope", "layers")  # what has no entry for each point


@dataclass(frozen=True, eq=False)
class WeakFace:
    """Hold the terms of all regions' conditions on faces of one name of k patches, for c components, at m points.

    The patches have equal degrees, knots, laws and data. Coefficients are those of the k patches.

    patches: (k,), their numbers. owners: (m,), the place among them of the patch of each point. x, normal: (3, m),
    points in space and outward unit normals. weights: (m,), the weights of integrals in space. inverse: (3, 3, m),
    J^-1. codes: (m,), bit i + 1 where condition i holds. projector: (c, c, m), P. values: (c, m), P g. gamma: (m,),
    zero where P is. slowest: (m,), the law's factor over the depth of the cube behind the face, that is gamma without
    its constants on a single span. factor: (c, c, m), that of u in an exchange, outside of P. loads: (c, m),
    the given flux into the body, outside of P. initial: (c, m), the law's initial flux . n, which is no part of t.
    is_whole: (k,), whether some P is given at all points of the face.

    tables: (m, k n_b n_c) each, values of the faces' functions and their derivatives in the two directions. slope: the
    derivative across the face of the functions of its layer, minus that of the next layer. layers: the coefficients of
    a face's functions and of the next layer in an array (n_u, n_v, n_w).
    """

    name: str
    patches: IntArray
    owners: IntArray
    form: Form
    x: Points
    normal: Array
    weights: Array
    inverse: Array
    codes: IntArray
    projector: Array
    values: Array
    gamma: Array
    slowest: Array
    factor: Array
    loads: Array
    initial: Array
    is_whole: Mask
    tables: tuple[csr_array, csr_array, csr_array]
    slope: float
    layers: tuple[tuple[int | slice, ...], tuple[int | slice, ...]]

    def on(self, patches: IntArray) -> WeakFace:
        """Return the terms on the faces of some of the patches, by their numbers."""
        chosen = np.flatnonzero(np.isin(self.patches, patches))
        points = np.flatnonzero(np.isin(self.owners, chosen))
        width = self.tables[0].shape[1] // len(self.patches)
        columns = (chosen[:, None] * width + np.arange(width)).ravel()
        value, along_b, along_c = (table[points][:, columns] for table in self.tables)
        parts: dict[str, Any] = {"tables": (value, along_b, along_c), "x": part_of(self.x, points)}
        parts |= {"owners": np.searchsorted(chosen, self.owners[points])}
        for name in (field.name for field in fields(self) if field.name not in (*OF_FACES, *parts)):
            parts[name] = getattr(self, name)[..., points]
        return replace(self, patches=self.patches[chosen], is_whole=self.is_whole[chosen], **parts)

    @cached_property
    def held(self) -> Array:
        """Return the weights times P, (c, c, m)."""
        return self.weights * self.projector

    @cached_property
    def stiff(self) -> Array:
        """Return the weights times the factor (c, c, m) of u . v: gamma P, and the factor of an exchange elsewhere."""
        return self.weights * (self.gamma * self.projector + self.factor)

    @cached_property
    def is_sprung(self) -> Mask:
        """Return the mask (m,) of the points where the flux depends on u."""
        return np.asarray(self.factor.any(axis=(0, 1)))

    @property
    def holding(self) -> Array:
        """Return P plus the factor of an exchange over its largest eigenvalue, (c, c, m): what resists motions."""
        found = self.projector.copy()
        sprung = np.flatnonzero(self.is_sprung)
        if len(sprung):
            own = self.factor[..., sprung]
            found[..., sprung] += own / np.linalg.eigvalsh(np.moveaxis(own, -1, 0))[:, -1]
        return found

    @property
    def held_initial(self) -> Array:
        """Return the initial flux (c, m) along the directions that are held, P times it."""
        return np.einsum("cdm,dm->cm", self.projector, self.initial)

    @property
    def axis(self) -> int:
        """Return the direction across the face."""
        return FACE_NAMES.index(self.name) // 2

    @property
    def places(self) -> Array:
        """Return the parameters (m, 3) of the points."""
        assert self.x.places is not None
        return self.x.places

    def holds(self, condition: int) -> Any:
        """Return the mask (m,) of the points where the condition with this number holds."""
        return self.codes >> (condition + 1) & 1 == 1

    def of_patches(self, values: Array) -> Array:
        """Return the sums (..., k) over the points of each patch of values (..., m)."""
        rows = values.reshape(-1, len(self.owners))
        found = [np.bincount(self.owners, row, len(self.patches)) for row in rows]
        return np.reshape(found, (*values.shape[:-1], len(self.patches)))

    def traces(self, coefficients: Array) -> tuple[Array, Array]:
        """Return u (c, m) and t = flux . n (c, m) of coefficients (k, c, n_u, n_v, n_w)."""
        here, behind = (self._layer(coefficients, layer) for layer in self.layers)
        value, along_b, along_c = self.tables
        u, slopes = value @ here, [self.slope * (value @ (here - behind)), along_b @ here, along_c @ here]
        grad = np.einsum("amc,adm->cdm", np.stack(slopes), self.inverse[self._order])
        return u.T, (self._flux(u.T, grad) * self.normal).sum(axis=1)

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the product of the terms and coefficients (k, c, n_u, n_v, n_w) to a result of the same shape."""
        u, flux = self.traces(coefficients)
        tested = np.einsum("cdm,dm->cm", self.stiff, u) - np.einsum("cdm,dm->cm", self.held, flux)
        self._spread(tested, -np.einsum("cdm,dm->cm", self.held, u), result)

    def matrix(self, shape: tuple[int, ...]) -> coo_array:
        """Return the matrix of the terms for coefficients of a shape (c, n_u, n_v, n_w) of each patch, as one vector.

        The k patches come one after another.
        """
        c, functions = shape[0], math.prod(shape[1:])
        found = coo_array((c * len(self.patches) * functions,) * 2)
        acting, held = (np.flatnonzero(own.any(axis=(0, 1))) for own in (self.stiff, self.held))
        if len(acting):
            values = self._of_components(self.tables[0][acting], self.layers[0], shape)
            found = found + values.T @ _at_points(self.stiff[..., acting]) @ values
        if len(held):
            found = found - self._fluxes(held, shape)
        return by_patches(found.tocoo(), shape)

    def _fluxes(self, points: IntArray, shape: tuple[int, ...]) -> csr_array:
        """Return the matrix of the terms with fluxes at some points, of components one after another."""
        here, slopes = self._slopes(points, shape)
        test = sum(_at_points(own[..., points]) @ slope for own, slope in zip(self._tests, slopes, strict=True))
        held = _at_points(self.held[..., points])
        return csr_array(here.T @ held @ self.flux_matrix(points, shape) + test.T @ held @ here)

    def flux_matrix(self, points: IntArray, shape: tuple[int, ...]) -> csr_array:
        """Return the matrix (c m, c k n_u n_v n_w) from coefficients to t at some points (m,).

        Rows and columns have the components one after another. shape: (c, n_u, n_v, n_w).
        """
        here, slopes = self._slopes(points, shape)
        by_value, *by_slopes = self._traces
        trace = sum(_at_points(own[..., points]) @ slope for own, slope in zip(by_slopes, slopes, strict=True))
        return csr_array(trace + _at_points(by_value[..., points]) @ here)

    def _slopes(self, points: IntArray, shape: tuple[int, ...]) -> tuple[csr_array, list[csr_array]]:
        """Return the matrices from coefficients to u, and to its slopes across and along the face, at some points."""
        tables = [table[points] for table in self.tables]
        here, behind = (self._of_components(tables[0], layer, shape) for layer in self.layers)
        along = (self._of_components(table, self.layers[0], shape) for table in tables[1:])
        return here, [self.slope * (here - behind), *along]

    def _of_components(self, table: csr_array, layer: tuple[int | slice, ...], shape: tuple[int, ...]) -> csr_array:
        """Return a table (m, k n_b n_c) of the functions of a layer as that (c m, c k n_u n_v n_w) of all functions."""
        return kron(eye_array(shape[0]), on_layer(table, layer, shape), format="csr")

    @property
    def _order(self) -> list[int]:
        """Return the direction across the face, and the two along it."""
        return [self.axis, *(a for a in range(3) if a != self.axis)]

    @property
    def _traces(self) -> list[Array]:
        """Return the derivatives (c, c, m) of t by u, and by the slopes of u across and along the face."""
        units = np.eye(len(self.projector))[:, :, None] * np.ones(len(self.weights))
        none = np.zeros_like(units[0])
        pairs = [[(unit, none[:, None] * self.normal) for unit in units]]
        pairs += [[(none, unit[:, None] * axis) for unit in units] for axis in self.inverse[self._order]]
        return [np.stack([(self._flux(*one) * self.normal).sum(axis=1) for one in own], axis=1) for own in pairs]

    @property
    def _tests(self) -> list[Array]:
        """Return the derivatives (c, c, m) of the test functions' t by their slopes across and along the face."""
        units = np.eye(len(self.projector))[:, :, None] * np.ones(len(self.weights))
        pulled = np.stack([self._pulled(unit) for unit in units])
        return [pulled[:, :, axis] for axis in self._order]

    def add_load(self, load: Array) -> None:
        """Add the terms of the right-hand side to a load (k, c, n_u, n_v, n_w)."""
        loads = self.weights * (self.loads + self.held_initial + self.gamma * self.values)
        self._spread(loads, -self.weights * self.values, load)

    def add_diagonal(self, component: int, diagonal: Array) -> None:
        """Add the diagonal of a component's block to an array (k, n_u, n_v, n_w)."""
        value, along_b, along_c = self.tables
        unit = np.zeros((self.form.components, len(self.weights)))
        unit[component] = 1.0
        tested = self._pulled(np.einsum("cdm,dm->cm", self.held, unit))[component]  # (3, m)
        across, b, c = tested[self.axis], *(tested[a] for a in range(3) if a != self.axis)
        squares = value.power(2)
        found = squares.T @ (self.stiff[component, component] - 2.0 * self.slope * across)
        found -= 2.0 * (value.multiply(along_b).T @ b + value.multiply(along_c).T @ c)
        layer = diagonal[:, *self.layers[0]]
        layer += found.reshape(layer.shape)

    def add_lumped(self, component: int, diagonal: Array, share: float = 1.0) -> None:
        """Add the integral of a share of gamma, and of factors, times each function to an array (k, n_u, n_v, n_w)."""
        layer = diagonal[:, *self.layers[0]]
        stiff = self.stiff[component, component] - (1.0 - share) * self.gamma * self.held[component, component]
        layer += (self.tables[0].T @ stiff).reshape(layer.shape)

    def stiffness(self, component: int) -> Array:
        """Return the factor (k,) of u v of one component that represents each face in the preconditioner, integrated.

        It is the integral of gamma and of the factors. Where values are given on a part of the face only, waves along
        the face have a factor between gamma and zero: the geometric mean of gamma and 1 / depth, of the whole cube
        behind the face, took the fewest iterations, 80, where gamma took 100 and a hundredth of this mean 105.
        """
        held = self.held[component, component]
        held = np.where(held > ROUNDING * self.weights, held, 0.0)
        loose, fast, slow = self.of_patches(
            np.stack([self.weights * self.factor[component, component], held * self.gamma, held * self.slowest])
        )
        return np.asarray(loose + np.where(self.is_whole, fast, np.sqrt(fast * slow)))

    def values_of(self, coefficients: Array) -> Array:
        """Return the values (c, m) of coefficients (k, c, n_u, n_v, n_w)."""
        return np.asarray((self.tables[0] @ self._layer(coefficients, self.layers[0])).T)

    def pulls(self, coefficients: Array) -> Array:
        """Return the reactions (c, m) that hold u at the points: P t - gamma P (u - g), with the weights.

        Summed over all points, with loads and sources, it is zero to the accuracy of the linear solver, as constant
        test functions show.
        """
        u, flux = self.traces(coefficients)
        pull = self.gamma * (np.einsum("cdm,dm->cm", self.projector, u) - self.values)
        density = np.einsum("cdm,dm->cm", self.projector, flux + self.initial) - pull
        return np.asarray(self.weights * density)

    def add_force(self, direction: Array, points: Mask, result: Array) -> None:
        """Add the part that depends on u of a sum of `pulls` along a direction (c,) to (k, c, n_u, n_v, n_w).

        It is that of each function. points: (m,), the mask of those whose reaction is meant.
        """
        along = np.einsum("cdm,d->cm", self.held * points, direction)
        self._spread(-self.gamma * along, along, result)

    def _layer(self, coefficients: Array, layer: tuple[int | slice, ...]) -> Array:
        """Return the coefficients (k n_b n_c, c) of a layer."""
        own = np.moveaxis(coefficients[:, :, *layer], 1, -1)  # (k, n_b, n_c, c)
        return np.ascontiguousarray(own).reshape(-1, own.shape[-1])

    def _flux(self, u: Array, grad: Array) -> Array:
        return np.asarray(self.form.flux(u, grad, self.x), dtype=np.float64)

    def _pulled(self, vectors: Array) -> Array:
        """Return flux(d (x) n) (c, 3, m) of vectors d (c, m), pulled back to the parameters, for the terms t(v) . d."""
        flux = self._flux(np.zeros_like(vectors), vectors[:, None] * self.normal)
        return np.einsum("adm,cdm->cam", self.inverse, flux)

    def _spread(self, values: Array, vectors: Array, result: Array) -> None:
        """Add int values . v + int vectors . t(v), both (c, m) with weights, to integrals (k, c, n_u, n_v, n_w)."""
        value, along_b, along_c = self.tables
        pulled = self._pulled(vectors)
        b, c = (pulled[:, a].T for a in range(3) if a != self.axis)
        across = self.slope * (value.T @ pulled[:, self.axis].T)
        here = value.T @ values.T + across + along_b.T @ b + along_c.T @ c
        for layer, part in zip(self.layers, (here, -across), strict=True):
            target = np.moveaxis(result[:, :, *layer], 1, -1)
            target += part.reshape(target.shape)


def _at_points(factors: Array) -> csr_array:
    """Return the matrix (c m, c m) of factors (c, c, m) at points."""
    return block_array([[diags_array(own) for own in row] for row in factors], format="csr")
