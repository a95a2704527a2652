"""Computes the forces of a law that is not linear, and their derivative, a matrix stored at the quadrature points."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation

from ..field import Points
from ..forms.form import ROUNDING, Form, reaction
from ..forms.jets import PAIRS
from ..forms.tangent import derivative
from . import group_kernels
from .grouped import BodyMatrix
from .groups import OnPatches
from .operator import Operator
from .stack import PatchStack, Piece, of_law, of_patches


@dataclass(frozen=True, eq=False)
class StackForces:
    """Compute the forces of any law on the patches of a stack.

    group: the number of the group that the patches belong to. places: (k,), their places in it. forms: the law of each
    patch. state: (k, q_u, history, q_w, q_v), the internal variables at the points, where the laws have a history.
    """

    stack: PatchStack
    group: int
    places: IntArray
    forms: Sequence[Form]
    state: Array | None = None

    def add(self, coefficients: Array, result: Array) -> None:
        """Add the forces for coefficients (patches, c, n_u, n_v, n_w) of the group to a result of that shape."""

        def add(piece: Piece) -> None:
            patches, _ = piece
            form, where = self.forms[patches[0]], (self.places[patches], self.stack.kinds[patches])
            law = form.flux if form.linear else form.whole_flux  # the loads of a linear law have its initial flux
            for q, rows, size, fields, gradient, x in self._planes(piece, coefficients):
                u, grad, scale = of_law(fields[:, :, 0]), of_law(gradient), np.sqrt(size)
                with np.errstate(all="ignore"):  # a step may go too far: whoever makes it looks at the result
                    flux = of_patches(np.asarray(law(u, grad, x), dtype=np.float64), size) * scale[:, None, None]
                    fields[:, :, 0] = of_patches(reaction(form, u, grad, x), size) * size[:, None]
                group_kernels.turn_fields(rows, np.ascontiguousarray(flux), fields[:, :, 1:], True)
                group_kernels.spread_splines(fields, *where, q, self.stack.tables, form.has_reaction, result)

        self.stack.on_pieces(add)

    def derivative(self, coefficients: Array) -> Array:
        """Return the derivative (k, q_u, c, 4, c, 4, q_w, q_v) with respect to u and its parametric derivatives.

        It has the weights of the points. Raises ValueError as `tangent.derivative` does.
        """
        c, (q_u, *plane) = coefficients.shape[1], (self.stack.shape[0], *self.stack.plane_shape)
        factors = np.empty((len(self.stack), q_u, c, 4, c, 4, *plane))

        def fill(piece: Piece) -> None:
            patches, _ = piece
            for q, rows, size, fields, gradient, x in self._planes(piece, coefficients):
                pull = np.zeros((len(patches), 4, 4, *plane))  # from u and its parametric derivatives to u and gradient
                pull[:, 0, 0], pull[:, 1:, 1:] = np.sqrt(size), rows
                law = derivative(self.forms[patches[0]], of_law(fields[:, :, 0]), of_law(gradient), x)
                half = np.einsum("mcidjwv,mbjwv->mcidbwv", of_patches(law, size), pull)
                factors[patches, q] = np.einsum("maiwv,mcidbwv->mcadbwv", pull, half)

        self.stack.on_pieces(fill)
        return factors

    def advanced(self, coefficients: Array) -> "StackForces":
        """Return the forces with the internal variables at the end of a load step, of a law with a history."""
        count = self.forms[0].history
        state = np.empty((len(self.stack), self.stack.shape[0], count, *self.stack.plane_shape))

        def fill(piece: Piece) -> None:
            patches, _ = piece
            for q, _, size, _, gradient, x in self._planes(piece, coefficients):
                state[patches, q] = of_patches(self.forms[patches[0]].advanced(of_law(gradient), x), size)

        self.stack.on_pieces(fill)
        return replace(self, state=state)

    def fitted(self, coefficients: Array) -> Array:
        """Return the coefficients (k, history, n_u, n_v, n_w) of splines that fit what a law shows (`Form.shown`) best.

        Coefficients of variables that must stay between those at the Gauss points do, and so do their splines.
        """
        assert self.state is not None
        state = np.empty_like(self.state)

        def fill(piece: Piece) -> None:
            patches, _ = piece
            for q, _, size, _, gradient, x in self._planes(piece, coefficients):
                state[patches, q] = of_patches(self.forms[patches[0]].shown(of_law(gradient), x), size)

        self.stack.on_pieces(fill)
        found = np.moveaxis(state, 2, 1)  # (k, history, q_u, q_w, q_v)
        parts = []
        for own, rule, space in zip(found, self.stack.rules, self.stack.spaces, strict=True):
            u, v, w = (
                np.linalg.pinv(collocation(knots, degree, points).toarray())
                for knots, degree, points in zip(space.knots, space.degrees, rule.points, strict=True)
            )
            parts.append(np.einsum("aq,hqrs,cr,bs->habc", u, own, w, v, optimize=True))
            for i in self.forms[0].bounded:
                np.clip(parts[-1][i], own[i].min(), own[i].max(), out=parts[-1][i])
        return np.stack(parts)

    def _planes(self, piece: Piece, source: Array) -> Iterator[tuple[int, Array, Array, Array, Array, Points]]:
        """Yield for every point q of u: q, rows R, w |det J|, fields, gradients, and the points in space.

        R and w |det J| are those of `PatchStack.geometry`. Fields (m, c, 4, q_w, q_v) are u and its parametric
        derivatives, gradients are (m, c, 3, q_w, q_v).
        """
        patches, _ = piece
        which, kinds = self.places[patches], self.stack.kinds[patches]
        fields = np.empty((len(patches), source.shape[1], 4, *self.stack.plane_shape))
        gradient = np.empty((len(patches), source.shape[1], 3, *self.stack.plane_shape))
        for q, rows, measure, x in self.stack.geometry(piece):
            group_kernels.evaluate_splines(source, which, kinds, q, self.stack.tables, fields)
            group_kernels.turn_fields(rows, fields[:, :, 1:], gradient, False)
            size = np.abs(measure)
            if self.state is not None:
                x.state = of_law(self.state[patches, q])
            yield q, rows, size, fields, gradient / np.sqrt(size)[:, None, None], x


@dataclass(frozen=True, eq=False)
class Forces:
    """Compute the integrals of flux : grad v + react . v of any law on all patches, with the terms on faces.

    matrix: of a simple law, whose stacks, rules and terms on faces are used. forms: the law of each patch. states: the
    internal variables of each stack; () at rest, and of laws without a history.
    """

    matrix: BodyMatrix
    forms: Sequence[Form]
    states: Sequence[Array] = ()

    @cached_property
    def stacks(self) -> list[StackForces]:
        """Return the forces on each stack."""
        groups, stacks = self.matrix.layout.groups, self.matrix.every_stack
        states: Sequence[Array | None] = self.states or [None] * len(stacks)
        return [
            StackForces(stack, number, places, [self.forms[groups[number][i]] for i in places], state)
            for (stack, number, places), state in zip(stacks, states, strict=True)
        ]

    def advanced(self, coefficients: OnPatches) -> "Forces":
        """Return the forces with the internal variables at the end of a load step; themselves without a history."""
        if not self.forms[0].history:
            return self
        groups = list(coefficients.in_groups)
        states = [own.advanced(groups[own.group]).state for own in self.stacks]
        found = replace(self, states=[state for state in states if state is not None])
        found.__dict__["of_faces"] = self.of_faces
        return found

    def fitted(self, coefficients: OnPatches) -> list[Array | None]:
        """Return the coefficients (history, n_u, n_v, n_w) of what the law shows on each patch, None at rest."""
        found: list[Array | None] = [None] * len(self.forms)
        groups = list(coefficients.in_groups)
        for own in self.stacks if self.states else ():
            numbers = [self.matrix.layout.groups[own.group][i] for i in own.places]
            for number, fit in zip(numbers, own.fitted(groups[own.group]), strict=True):
                found[number] = fit
        return found

    def apply(self, coefficients: OnPatches) -> OnPatches:
        """Return the forces for all coefficients."""
        result = self.matrix.layout.empty(coefficients.components)
        groups = list(zip(coefficients.in_groups, result.in_groups, strict=True))
        for own in self.stacks:
            own.add(*groups[own.group])
        self.add_faces(coefficients, result)
        return result

    def add_faces(self, coefficients: OnPatches, result: OnPatches) -> None:
        """Add the products of the terms on faces, which are linear, to a result."""
        if self.of_faces.nnz:
            result.flat[:] += self.of_faces @ coefficients.flat

    @cached_property
    def of_faces(self) -> csr_array:
        """Return the matrix of the terms on faces."""
        return self.matrix.matrix_of(self.matrix.faces)

    def derivative(self, coefficients: OnPatches) -> "Tangent":
        """Return the derivative at some coefficients. Raises ValueError as `tangent.derivative` does."""
        groups = list(coefficients.in_groups)
        return Tangent(self, [own.derivative(groups[own.group]) for own in self.stacks])


@dataclass(frozen=True, eq=False)
class Tangent:
    """Apply the derivative of forces. factors: those of `StackForces.derivative` of each stack."""

    forces: Forces
    factors: Sequence[Array]

    @property
    def is_symmetric(self) -> bool:
        """Return whether the matrix is its own transpose, tested on the planes in the middle."""
        middles = [factors[:, factors.shape[1] // 2] for factors in self.factors]
        return all(
            np.abs(own - own.transpose(0, 3, 4, 1, 2, 5, 6)).max() <= ROUNDING * np.abs(own).max() for own in middles
        )

    def apply(self, coefficients: OnPatches) -> OnPatches:
        """Return the products with all coefficients."""
        result = self.forces.matrix.layout.empty(coefficients.components)
        groups = list(zip(coefficients.in_groups, result.in_groups, strict=True))
        for own, factors in zip(self.forces.stacks, self.factors, strict=True):
            _add_products(own, factors, *groups[own.group])
        self.forces.add_faces(coefficients, result)
        return result

    @property
    def pointwise(self) -> Iterator[tuple[PatchStack, int, IntArray, Callable[[Piece], Array]]]:
        """Yield each stack, its group, the places there, and the derivatives at the points of a piece."""
        for own, factors in zip(self.forces.stacks, self.factors, strict=True):

            def derivative(piece: Piece, factors: Array = factors) -> Array:
                return factors[np.ix_(*piece)]

            yield own.stack, own.group, own.places, derivative

    def block(self, component: int) -> list[Operator]:
        """Return the symmetric part of a component's diagonal block on each patch, for its own gradient and value."""
        matrix, found = self.forces.matrix, dict[int, Array]()
        for stack, factors in zip(self.forces.stacks, self.factors, strict=True):
            own = factors[:, :, component, :, component]
            entries = [0.5 * (own[:, :, 1 + i, 1 + j] + own[:, :, 1 + j, 1 + i]) for i, j in PAIRS]
            entries += [np.maximum(own[:, :, 0, 0], 0.0)] if stack.forms[0].has_reaction else []
            numbers = [matrix.layout.groups[stack.group][i] for i in stack.places]
            found.update(zip(numbers, np.stack(entries, axis=2), strict=True))
        return [
            Operator(part.space, part.rule, part.threads, found[number], component, faces=part.faces)
            for number, part in enumerate(matrix.parts)
        ]


def _add_products(own: StackForces, factors: Array, coefficients: Array, result: Array) -> None:
    """Add the products of a tangent and coefficients (patches, c, n_u, n_v, n_w) of a group to a result."""
    stack, has_value = own.stack, own.forms[0].has_reaction

    def add(piece: Piece) -> None:
        where = own.places, *piece, stack.kinds, stack.tables, factors, has_value
        group_kernels.multiply_tangents(coefficients, *where, result)

    stack.on_pieces(add)
