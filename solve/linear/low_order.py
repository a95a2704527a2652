"""Preconditions a body of patches by trilinear elements on the Greville points.

With N the values of the splines at the Greville points, and K the matrix of the same law for trilinear functions on
these points, N^T K N is spectrally near A, whatever the shapes, materials and supports of the patches. The
preconditioner is N^-1 K^-1 N^-T, with a multigrid cycle for K^-1, and a share of the inverted diagonal of A, for places
where the map bends within a span and K is too stiff (docs/solver.md).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.sparse import bsr_array, coo_array, csr_array

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body

from ..discretization.entry_kernels import add_entries
from ..discretization.grouped import BodyMatrix, assemble_body
from ..discretization.groups import CoefficientLayout, OnPatches
from ..discretization.operator import Operator, diagonals
from ..discretization.quadrature import gauss_rule
from ..discretization.space import of_each
from ..discretization.stack import PatchStack, Piece
from ..discretization.unknowns import Glued
from .grids import Grid, on_nodes
from .multigrid import Multigrid
from .nodal import NodalBasis
from .preconditioner import NO_FACTORS, leaves_constants

HELD = 0.25  # of Nitsche's factor, from which the flux takes: 192 hexahedra take 72 iterations, with 1 they take 99
COUPLED = 0.3  # of Nitsche's factor where two regions are coupled: from 0.2 to 0.5 it makes no difference
LOCAL = 0.5  # the share of the inverted diagonal: on the flange 52 iterations, without it 70, with 2 it is 65

# A stack, its group, the places there, and a function that returns a law's matrices at the points of a piece.
Pointwise = tuple[PatchStack, int, IntArray, Callable[[Piece], Array]]


class Survey(NamedTuple):
    """Hold the diagonal (c, n_u, n_v, n_w) of each patch's matrix, and (patches,) which leave constants free."""

    diagonal: OnPatches
    free: Mask


@dataclass(frozen=True, eq=False)
class LowOrder:
    """Apply the preconditioner to residuals (c, m) of the free unknowns.

    local: (c, m), a share of the inverse of A's diagonal. cycle: approximates K^-1; None where K has no factor.
    is_open: whether a constant is free; the result then has the mean zero.
    """

    basis: NodalBasis
    cycle: Multigrid | None
    local: Array
    is_open: bool

    @classmethod
    def of(
        cls,
        body: Body,
        unknowns: Glued,
        low_order: Callable[[Glued], bsr_array],
        survey: Survey,
        is_loose: bool,
    ) -> "LowOrder":
        """Return the preconditioner of a matrix on a body.

        low_order: returns K for the nodes of this process. is_loose: whether motions may be free.
        """
        is_open = all(unknowns.processes.shared(bool(survey.free.all())))
        with np.errstate(all="ignore"):  # it is looked at afterwards
            grid, diagonal = Grid.of(body, unknowns.of_body), unknowns.collect(survey.diagonal)
            cycle = Multigrid.of(grid, unknowns, low_order(on_nodes(unknowns.alone)), is_open or is_loose)
            local = np.divide(1.0, np.abs(diagonal), out=np.zeros_like(diagonal), where=diagonal != 0.0)
            found = cls(NodalBasis.of(unknowns), cycle, LOCAL * local, is_open)
            return found if found._is_usable() else cls(found.basis, None, local, is_open)

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual, in the shape (c, ...) of the residual."""
        given = residual.reshape(self.local.shape)
        found = self.local * given
        if self.cycle is not None:
            found += self.basis.coefficients(self.cycle(self.basis.integrals(given)))
        if self.is_open:
            total = self.basis.unknowns.processes.total
            found -= total(found.sum()) / total(math.prod(found.shape))
        return found.reshape(residual.shape)

    @property
    def weakness(self) -> str:
        """Return what is left out, as a sentence for the report; "" for nothing."""
        return "" if self.cycle is not None else NO_FACTORS

    def _is_usable(self) -> bool:
        found = self(np.random.default_rng(0).uniform(-1.0, 1.0, self.local.shape))
        return all(self.basis.unknowns.processes.shared(bool(np.isfinite(found).all())))


def trilinear(nodes: Glued, matrix: BodyMatrix) -> bsr_array:
    """Return the matrix of the law of another one for trilinear functions, in blocks of components."""
    form = matrix.laws[0].form
    stacks = [(own.stack, own.group, own.places, own.derivative) for own in on_trilinear(nodes, matrix).every_matrix]
    found = entries_of(nodes, stacks, form.components, form.symmetric, matrix)
    for coupling in matrix.couplings:
        own = coupling.penalty(nodes.spaces, nodes.layout, COUPLED)
        found = bsr_array(found + _of_nodes(own, nodes, form.components), blocksize=found.blocksize)
    return found


def _of_nodes(matrix: csr_array, nodes: Glued, components: int) -> bsr_array:
    """Return a matrix of coefficients, as `OnPatches.flat` has them, for free nodes in blocks of components."""
    count = nodes.shape[0]
    node = nodes.layout.numbers(nodes.places, components, 0)
    component = nodes.layout.numbers([np.zeros_like(own) for own in nodes.places], components, 1)
    entries = matrix.tocoo()
    free = (node[entries.row] < count) & (node[entries.col] < count)
    places = [(node * components + component)[own[free]] for own in (entries.row, entries.col)]
    found = coo_array((entries.data[free], places), shape=(components * count,) * 2)
    return bsr_array(found.tocsr(), blocksize=(components, components))


def on_trilinear(nodes: Glued, matrix: BodyMatrix) -> BodyMatrix:
    """Return the operator of the law of another one on trilinear functions, without terms on faces."""
    each = zip(matrix.laws, nodes.spaces, of_each(gauss_rule, nodes.spaces), strict=True)
    laws = [law._replace(space=space, rule=rule, source=None) for law, space, rule in each]
    return assemble_body(nodes.layout, laws, matrix.parts[0].threads)[0]


def entries_of(
    nodes: Glued, stacks: Iterable[Pointwise], components: int, is_symmetric: bool, matrix: BodyMatrix
) -> bsr_array:
    """Return the matrix of trilinear functions of a law, in blocks of components.

    stacks: those of the law. matrix: has the terms on faces, which are lumped. Of a law that is not symmetric the
    symmetric part of the components' own blocks is returned.
    """
    rows, columns, where = _pattern(nodes)
    entries = np.zeros((len(rows), components, components))
    for stack, group, places, derivative in stacks:
        for piece in stack.pieces:
            here = where[group][places[piece[0]]]
            add_entries(derivative(piece), stack.kinds[piece[0]], piece[1], stack.tables, here, entries)
    on_faces = nodes.layout.empty(components)
    for face in matrix.faces:
        found = np.zeros_like(on_faces.of(face.patches))
        for component in range(components):
            face.add_lumped(component, found[:, component], HELD)
        on_faces.add(face.patches, found)
    lumped = nodes.collect(on_faces)
    here = rows == columns
    for component in range(components):
        entries[here, component, component] += lumped[component, rows[here]]
    starts = np.searchsorted(rows, np.arange(nodes.shape[0] + 1))
    shape = (components * nodes.shape[0],) * 2
    if is_symmetric:
        return bsr_array((entries, columns, starts), shape=shape)
    blocks = bsr_array((entries * np.eye(components), columns, starts), shape=shape)
    return bsr_array(0.5 * (blocks + blocks.T), blocksize=(components, components))


def _pattern(nodes: Glued) -> tuple[IntArray, IntArray, list[IntArray]]:
    """Return rows (k,) and columns (k,) of the entries of trilinear functions, sorted by rows, and their places.

    The places (patches, 3, 3, 3, n_u, n_v, n_w) of each group are those of a node and the one beside it whose numbers
    have these remainders by 3; -1 for none.
    """
    count = nodes.shape[0]
    places = nodes.layout.numbers(nodes.places, 1, 0)
    seen = np.concatenate([_seen(nodes.layout, group) for group in range(len(nodes.layout.groups))], axis=1)
    columns = np.where(seen < 0, count, places[seen])
    is_free = (places < count) & (columns < count)
    keys, inverse = np.unique((places * count + columns)[is_free], return_inverse=True)
    where = np.full(seen.shape, -1)
    where[is_free] = inverse
    found = []
    for group in nodes.layout.groups:
        shape, first = nodes.layout.shapes[group[0]], nodes.layout.starts[group[0]]
        part = where[:, first : first + len(group) * math.prod(shape)].reshape(3, 3, 3, len(group), *shape)
        found.append(np.ascontiguousarray(np.moveaxis(part, 3, 0)))
    return keys // count, keys % count, found


def _seen(layout: CoefficientLayout, group: int) -> IntArray:
    """Return the place (27, nodes) of the only node of each colour that each node of a group sees; -1 for none."""
    first = layout.groups[group][0]
    shape, count = layout.shapes[first], len(layout.groups[group])
    each = [[_of_colour(n, colour) for colour in range(3)] for n in shape]
    found = []
    for a, b, c in product(range(3), repeat=3):
        u, v, w = each[0][a][:, None, None], each[1][b][:, None], each[2][c]
        flat = (u * shape[1] + v) * shape[2] + w
        found.append(np.where((u < 0) | (v < 0) | (w < 0), -1, flat).ravel())
    own = np.stack(found)[:, None]
    starts = layout.starts[first] + np.arange(count)[:, None] * own.shape[2]
    return np.asarray(np.where(own < 0, -1, own + starts)).reshape(27, -1)


def _of_colour(n: int, colour: int) -> IntArray:
    """Return for each of n nodes in a row the one of a colour, itself or beside it; -1 for none."""
    lowest = np.arange(n) - 1
    found = lowest + (colour - lowest) % 3
    return np.where((found >= 0) & (found < n), found, -1)


def surveyed(matrix: BodyMatrix) -> Survey:
    """Return the survey of the matrix of a body; of several components one block after another is assembled."""
    first, components = matrix.laws[0], matrix.laws[0].form.components
    blocks = ((matrix.block(i) if first.component is None else matrix).parts for i in range(components))
    return survey_of(matrix, blocks)


def survey_of(matrix: BodyMatrix, blocks: Iterable[Sequence[Operator]]) -> Survey:
    """Return the survey of operators, of each component those of all patches; the terms on faces are the matrix's."""
    layout, components = matrix.layout, matrix.laws[0].form.components
    diagonal, free = layout.empty(components), np.ones(len(layout.shapes), dtype=bool)
    for component, parts in enumerate(blocks):
        for own, entries in zip(diagonal, diagonals(parts), strict=True):
            own[component] = entries
        free &= list(map(leaves_constants, parts))
        for face in matrix.shared_faces:
            found = np.zeros_like(diagonal.of(face.patches))
            face.add_diagonal(component, found[:, component])
            diagonal.add(face.patches, found)
            free[face.patches] &= face.stiffness(component) == 0.0
    for coupling in matrix.couplings:
        diagonal.flat[:] += coupling.matrix.diagonal()
    return Survey(diagonal, free)
