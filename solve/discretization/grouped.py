"""Assembles and applies the matrices of all patches of a body: patches of one shape are one stack.

Their factors (q_u, .., q_w, q_v) are parts of an array (k, q_u, .., q_w, q_v), which compiled kernels pass.
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import BSplineVolume

from ..forms.form import Form
from ..forms.jets import PAIRS
from . import group_kernels, lane_kernels
from .coupling import Coupling
from .groups import CoefficientLayout, OnPatches
from .operator import FaceTerm, Operator, Source, assemble_stack, derivative_of, multiply_law
from .quadrature import GaussRule
from .space import TrialSpace
from .stack import PatchStack, Piece, Stacked, stacks_of
from .weak import WeakFace


class Law(NamedTuple):
    """State what the matrix and the load of a patch are assembled from, as `operator.assemble` takes it.

    component: the component whose symmetric part is assembled; None for the whole law. same: equal for patches whose
    laws and sources are the same functions of the points.
    """

    volume: BSplineVolume
    space: TrialSpace
    rule: GaussRule
    form: Form
    source: Source | None = None
    component: int | None = 0
    same: Hashable = None


@dataclass(frozen=True, eq=False)
class StackMatrix:
    """Apply the matrices of the patches of a stack.

    group: the number of the group that the patches belong to. places: (k,), their places in it. forms: the law of each
    patch. factors: what their operators store at the points, (k, q_u, .., q_w, q_v), of scalar laws factors, of
    constant ones rows; None for other laws. laws: (k, c, 3, c, 3), of constant laws the matrix from a gradient to its
    flux.
    """

    stack: PatchStack
    group: int
    places: IntArray
    forms: Sequence[Form]
    factors: Array | None
    laws: Array | None

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the products with coefficients (patches, c, n_u, n_v, n_w) of the group to a result of that shape."""
        stack = self.stack

        def multiply(piece: Piece) -> None:
            if self.factors is None:
                multiply_law(stack, piece, self.places, self.forms[piece[0][0]], coefficients, result)
                return
            where = self.places, *piece, stack.kinds, stack.tables, self.factors
            if self.laws is None and stack.is_small and math.prod(stack.plane_shape) <= lane_kernels.MOST:
                lane_kernels.multiply_small(coefficients, *where, result)
            elif self.laws is None:
                group_kernels.multiply_patches(coefficients, *where, result)
            else:
                group_kernels.multiply_laws(coefficients, *where, self.laws, result)

        stack.on_pieces(multiply)

    def derivative(self, piece: Piece) -> Array:
        """Return the matrices (m, q, c, 4, c, 4, q_w, q_v) at some points, with weights; see `at_points`."""
        patches, points = piece
        here = None if self.factors is None else self.factors[np.ix_(patches, points)]
        if here is None:
            return derivative_of(self.forms[patches[0]], self.stack, piece)
        if self.laws is not None:
            return _of_constant(here, self.laws[patches])
        found = np.zeros((*here.shape[:2], 1, 4, 1, 4, *here.shape[3:]))
        for entry, (a, b) in enumerate(PAIRS):
            found[:, :, 0, 1 + a, 0, 1 + b] = found[:, :, 0, 1 + b, 0, 1 + a] = here[:, :, entry]
        found[:, :, 0, 0, 0, 0] = here[:, :, 6:].sum(axis=2)  # of the reaction, where there is one
        return found


@dataclass(frozen=True, eq=False)
class BodyMatrix:
    """Apply the matrices of all patches of a body.

    parts: the matrix of each patch; what they store at the points is part of the stacks. alone: the numbers of the
    patches that are in no stack, because no other patch has their shape. faces: the terms on faces, those of patches
    that are alike as one; the part of a patch alone has its own ones, too. couplings: the terms that couple regions.
    """

    layout: CoefficientLayout
    laws: Sequence[Law]
    parts: Sequence[Any]  # MatrixFree
    stacks: Sequence[StackMatrix]
    alone: Sequence[int]
    faces: Sequence[FaceTerm] = ()
    couplings: Sequence[Coupling] = ()

    def apply(self, coefficients: Sequence[Array]) -> OnPatches:
        """Return the products (c, n_u, n_v, n_w) with all coefficients of each patch, fixed ones included."""
        source = self.layout.joined(coefficients)
        result = self.layout.empty(source.components)
        groups = list(zip(source.in_groups, result.in_groups, strict=True))
        for matrix in self.stacks:
            matrix.add_product(*groups[matrix.group])
        for patch in self.alone:
            result[patch][:] = self.parts[patch].apply(source[patch])
        self._add_stacked_faces(source, result)
        for coupling in self.couplings:
            result.flat[:] += coupling.matrix @ source.flat
        return result

    def add_faces(self, coefficients: OnPatches, result: OnPatches) -> None:
        """Add the products of the terms on faces, of all patches, to a result."""
        self._add_stacked_faces(coefficients, result)
        for patch in self.alone:
            for face in self.parts[patch].faces.values():
                face.add_product(coefficients[patch][None], result[patch][None])

    def _add_stacked_faces(self, coefficients: OnPatches, result: OnPatches) -> None:
        if self._of_faces.nnz:
            result.flat[:] += self._of_faces @ coefficients.flat

    @cached_property
    def _of_faces(self) -> csr_array:
        return self.matrix_of(self.shared_faces)

    @property
    def weak(self) -> list[WeakFace]:
        """Return the terms of conditions on regions."""
        return [face for face in self.faces if isinstance(face, WeakFace)]

    @property
    def shared_faces(self) -> list[FaceTerm]:
        """Return the terms on faces that are in no part."""
        return [face for face in self.faces if not _is_of_one(face, self.alone)]

    def matrix_of(self, faces: Sequence[FaceTerm]) -> csr_array:
        """Return the matrix of terms on faces, of all coefficients of all patches as one vector."""
        components, starts = self.laws[0].form.components, self.layout.starts
        found: csr_array = csr_array((components * starts[-1],) * 2)
        for face in faces:
            shape = components, *self.layout.shapes[face.patches[0]]
            own, size = face.matrix(shape), math.prod(shape)
            places = [components * starts[face.patches[row // size]] + row % size for row in own.coords]
            found = found + coo_array((own.data, places), shape=found.shape).tocsr()
        return found

    @property
    def every_matrix(self) -> list[StackMatrix]:
        """Return the matrices of all stacks, of one patch alone, too."""
        groups, places = self.layout.places
        found = list(self.stacks)
        for patch in self.alone:
            part, where = self.parts[patch], (int(groups[patch]), places[patch : patch + 1])
            if isinstance(part, Operator):
                found.append(StackMatrix(part.stack, *where, [self.laws[patch].form], part.factors[None], None))
            else:
                laws = None if part.rows is None else law_of(part.form)[None]
                rows = None if part.rows is None else part.rows[None]
                found.append(StackMatrix(part.stack, *where, [part.form], rows, laws))
        return found

    @property
    def every_stack(self) -> list[tuple[PatchStack, int, IntArray]]:
        """Return the stacks of all patches, with the number of the group and the places in it, one patch alone too."""
        threads = self.parts[0].threads
        groups = [[_stacked(self.laws[patch]) for patch in group] for group in self.layout.groups]
        each = [(k, one) for k, group in enumerate(groups) for one in stacks_of(group, threads)]
        return [(stack, k, np.array(places)) for k, (places, stack) in each]

    def with_faces(self, faces: Sequence[FaceTerm], couplings: Sequence[Coupling] = ()) -> "BodyMatrix":
        """Return the same matrix with terms on faces, and terms that couple regions."""
        parts = list(self.parts)
        for patch in self.alone:
            own = {face.name: face for face in faces if _is_of_one(face, [patch])}
            parts[patch] = replace(parts[patch], faces=own) if own else parts[patch]
        return replace(self, parts=parts, faces=faces, couplings=couplings)

    def of(self, laws: Sequence[Law]) -> "BodyMatrix":
        """Return the matrix of other laws on the same patches, without terms on faces."""
        return assemble_body(self.layout, laws, self.parts[0].threads)[0]

    def block(self, component: int) -> "BodyMatrix":
        """Return the symmetric part of a component's diagonal block, for its own gradient and value."""
        found = self.of([law._replace(source=None, component=component) for law in self.laws])
        both = zip(found.parts, self.parts, strict=True)
        parts = [replace(block, faces=own.faces, component=component) for block, own in both]
        return replace(found, parts=parts, faces=self.faces, couplings=self.couplings)


def assemble_body(layout: CoefficientLayout, laws: Sequence[Law], threads: int) -> tuple[BodyMatrix, OnPatches]:
    """Return the matrix and the loads (c, n_u, n_v, n_w) of the laws on all patches, without terms on faces."""
    parts: list[Any] = [None] * len(laws)
    loads, stacks, alone = layout.empty(laws[0].form.components), [], []
    for number, (group, own_loads) in enumerate(zip(layout.groups, loads.in_groups, strict=True)):
        for places, stack in stacks_of([_stacked(laws[patch]) for patch in group], threads):
            own = [laws[group[place]] for place in places]
            forms, sources, component = [law.form for law in own], [law.source for law in own], own[0].component
            found, stored, own_loads[places] = assemble_stack(stack, forms, sources, component)
            for place, matrix in zip(places, found, strict=True):
                parts[group[place]] = matrix
            if len(places) == 1:
                alone.append(group[places[0]])
                continue
            is_constant = stored is not None and component is None
            matrices = np.stack(list(map(law_of, forms))) if is_constant else None
            stacks.append(StackMatrix(stack, number, np.array(places), forms, stored, matrices))
    return BodyMatrix(layout, laws, parts, stacks, alone), loads


def _is_of_one(face: FaceTerm, patches: Sequence[int]) -> bool:
    """Return whether a term is that of one patch, which is one of these."""
    return len(face.patches) == 1 and face.patches[0] in patches


def _stacked(law: Law) -> Stacked:
    """Return a patch that is stacked with those whose laws store as much at a point."""
    volume, space, rule, form, _, component, same = law
    return Stacked(volume, space, rule, same, (form.components, form.has_reaction, form.constant, component))


def _of_constant(rows: Array, laws: Array) -> Array:
    """Return the matrices of `StackMatrix.derivative` from rows (m, q, 3, 3, ..) and laws (m, c, 3, c, 3)."""
    count = laws.shape[1]
    found = np.zeros((*rows.shape[:2], count, 4, count, 4, *rows.shape[4:]))
    half = np.einsum("mcidj,mqbjwv->mqcidbwv", laws, rows)
    np.einsum("mqaiwv,mqcidbwv->mqcadbwv", rows, half, out=found[:, :, :, 1:, :, 1:])
    return found


def law_of(form: Form) -> Array:
    """Return the matrix (c, 3, c, 3) of a constant law from a gradient to its flux."""
    size = 3 * form.components
    units = np.eye(size).reshape(form.components, 3, size)
    flux = np.asarray(form.flux(np.zeros((form.components, size)), units, None), dtype=np.float64)
    return np.ascontiguousarray(flux).reshape(form.components, 3, form.components, 3)
