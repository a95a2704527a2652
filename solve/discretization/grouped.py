"""Applies the matrices of all patches of a body at once: those of one shape are one array, which compiled kernels pass.

Factors (q_u, .., q_w, q_v) of a patch become factors (k, q_u, .., q_w, q_v) of k patches that have equal degrees, equal
numbers of functions and of quadrature points. Threads take pieces of patches. A matrix of one patch stays as it is: its
pieces are planes of points.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.threads import in_parallel

from ..forms.form import Form
from . import group_kernels, kernels
from .groups import Layout, OnPatches
from .operator import FaceTerm, FormOperator, MatrixFree, Operator

PIECES = 16  # of a stack, a thread: some wait less where others take longer
FEWEST = 4  # patches of a piece


@dataclass(frozen=True, eq=False)
class Stack:
    """Apply the matrices of k patches of one group.

    patches: (k,), the places of the patches in their group. tables: those of the patches, with a leading dimension k.
    factors: (k, q_u, .., q_w, q_v), of scalar laws, or the rows of constant laws. laws: (k, c, 3, c, 3), the matrices
    of constant laws from a gradient to its flux; None for factors.
    """

    patches: IntArray
    tables: kernels.Tables
    factors: Array
    laws: Array | None
    threads: int

    @classmethod
    def of(cls, patches: Sequence[int], matrices: Sequence[MatrixFree]) -> "Stack":
        """Return the stack of matrices with the same `key_of`."""
        u, v, w = (
            (np.stack([first for first, _, _ in each]), np.stack([basis for _, basis, _ in each]), each[0][2])
            for each in zip(*(matrix.tables for matrix in matrices), strict=True)
        )
        laws = [law_of(matrix.form) for matrix in matrices if isinstance(matrix, FormOperator)]
        factors = np.stack([stored(matrix) for matrix in matrices])
        return cls(np.array(patches), (u, v, w), factors, np.stack(laws) if laws else None, matrices[0].threads)

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the products with coefficients (patches, c, n_u, n_v, n_w) of a group to a result of the same shape."""
        count = len(self.patches)
        pieces = np.array_split(np.arange(count), max(1, min(PIECES * self.threads, count // FEWEST)))
        in_parallel(lambda piece: self._multiply(piece, coefficients, result), pieces, self.threads)

    def _multiply(self, piece: IntArray, coefficients: Array, result: Array) -> None:
        """Add the products of a piece of the k patches."""
        where = self.patches, piece, self.tables, self.factors
        if self.laws is None:
            group_kernels.multiply_patches(coefficients, *where, result)
        else:
            group_kernels.multiply_laws(coefficients, *where, self.laws, result)


@dataclass(frozen=True, eq=False)
class BodyMatrix:
    """Apply the matrices of all patches of a body.

    parts: the matrix of each patch, whose arrays at the points are parts of the stacks. stacks: with the number of the
    group of each. alone: the numbers of the patches whose matrices are in no stack. faces: the terms on faces of
    patches in stacks, with the number of the patch.
    """

    layout: Layout
    parts: Sequence[Any]  # MatrixFree
    stacks: Sequence[tuple[int, Stack]]
    alone: Sequence[int]
    faces: Sequence[tuple[int, FaceTerm]]

    @classmethod
    def of(cls, layout: Layout, matrices: Sequence[MatrixFree]) -> "BodyMatrix":
        """Return the matrix of a body from those of its patches, whose arrays at the points are copied into stacks."""
        parts, stacks, alone, faces = list(matrices), [], [], []
        for number, group in enumerate(layout.groups):
            found: dict[Any, list[int]] = {}
            for place, patch in enumerate(group):
                found.setdefault(key_of(matrices[patch]), []).append(place)
            for key, places in found.items():
                own = [group[place] for place in places]
                if key is None or len(own) == 1:
                    alone += own
                    continue
                stack = Stack.of(places, [matrices[patch] for patch in own])
                stacks.append((number, stack))
                for patch, factors in zip(own, stack.factors, strict=True):
                    name = "rows" if isinstance(parts[patch], FormOperator) else "factors"
                    parts[patch] = replace(parts[patch], **{name: factors})
                faces += [(patch, face) for patch in own for face in matrices[patch].faces.values()]
        return cls(layout, parts, stacks, alone, faces)

    def apply(self, coefficients: Sequence[Array]) -> OnPatches:
        """Return the products (c, n_u, n_v, n_w) with all coefficients of each patch, fixed ones included."""
        source = self.layout.joined(coefficients)
        result = self.layout.empty(source.components)
        groups = list(zip(source.in_groups, result.in_groups, strict=True))
        for number, stack in self.stacks:
            stack.add_product(*groups[number])
        for patch in self.alone:
            result[patch][:] = self.parts[patch].apply(source[patch])
        for patch, face in self.faces:
            face.add_product(source[patch], result[patch])
        return result


def key_of(matrix: MatrixFree) -> Any:
    """Return what patches have in common whose matrices are stacked; None for a matrix that is applied alone."""
    if isinstance(matrix, Operator):
        return matrix.factors.shape
    if isinstance(matrix, FormOperator) and matrix.rows is not None:
        return matrix.rows.shape, matrix.form.components
    return None


def stored(matrix: MatrixFree) -> Array:
    """Return the array that a matrix of a stack holds at its points."""
    name = "rows" if isinstance(matrix, FormOperator) else "factors"
    return np.asarray(getattr(matrix, name))


def law_of(form: Form) -> Array:
    """Return the matrix (c, 3, c, 3) of a constant law from a gradient to its flux."""
    size = 3 * form.components
    units = np.eye(size).reshape(form.components, 3, size)
    flux = np.asarray(form.flux(np.zeros((form.components, size)), units, None), dtype=np.float64)
    return np.ascontiguousarray(flux).reshape(form.components, 3, form.components, 3)
