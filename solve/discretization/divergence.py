"""Defines Divergence: the terms that couple displacements and pressures of a nearly incompressible body."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from parameterize.arrays import Array, IntArray

from .group_kernels import of_kind
from .grouped import BodyMatrix
from .groups import OnPatches
from .kernels import Tables, compiled, evaluate_plane, spread_plane
from .operator import ONE
from .stack import PatchStack, Piece
from .weak import WeakFace

Weights = tuple[Array, Array, Array]  # of the points of the three directions, (kinds, q) each


class _PressedStack(NamedTuple):
    """Hold a stack of patches of a group: their places in it, and the rows R (k, q_u, 3, 3, q_w, q_v) at the points."""

    stack: PatchStack
    group: int
    places: IntArray
    numbers: IntArray
    rows: Array
    weights: Weights


@dataclass(frozen=True, eq=False)
class Divergence:
    """Apply B and C of - int r div u - int r p / lambda, u and p splines of the trial spaces of all patches.

    matrix: that of the law 2 mu eps on the patches, whose points and faces B has too. compliance: 1 / lambda of each
    patch. On a face that holds P u weakly, B has the term int r n . P u besides.
    """

    matrix: BodyMatrix
    compliance: Array

    def of_displacement(self, u: OnPatches) -> OnPatches:
        """Return B u, the integrals (1, n_u, n_v, n_w) on each patch, of coefficients (3, n_u, n_v, n_w)."""
        result = self.matrix.layout.empty(1)
        groups = list(zip(u.in_groups, result.in_groups, strict=True))
        for own in self._stacks:

            def add(piece: Piece, own: _PressedStack = own) -> None:
                source, total = groups[own.group]
                where = own.places, *piece, own.stack.kinds, own.stack.tables
                divergences(source, *where, own.rows, own.weights, total)

            own.stack.on_pieces(add)
        for face in self.faces:
            face.add_volumes(u, result)
        return result

    def of_pressure(self, p: OnPatches) -> OnPatches:
        """Return B^T p and - C p, integrals (4, n_u, n_v, n_w) on each patch, of coefficients (1, n_u, n_v, n_w)."""
        result = self.matrix.layout.empty(4)
        groups = list(zip(p.in_groups, result.in_groups, strict=True))
        for own in self._stacks:
            compliance = self.compliance[own.numbers]

            def add(piece: Piece, own: _PressedStack = own, compliance: Array = compliance) -> None:
                source, total = groups[own.group]
                where = own.places, *piece, own.stack.kinds, own.stack.tables
                spread_pressures(source, *where, own.rows, own.weights, compliance, total)

            own.stack.on_pieces(add)
        for face in self.faces:
            face.add_forces(p, result)
        return result

    @cached_property
    def faces(self) -> "list[HeldFace]":
        """Return the faces that hold displacements weakly."""
        held = [face for face in self.matrix.weak if face.held.any()]
        return [HeldFace(face, np.einsum("cdm,dm->cm", face.held, face.normal)) for face in held]

    @cached_property
    def _stacks(self) -> list[_PressedStack]:
        return list(self._found())

    def _found(self) -> Iterator[_PressedStack]:
        groups = self.matrix.layout.groups
        for own in self.matrix.stacks:
            assert own.factors is not None
            numbers = np.array(groups[own.group])[own.places]
            yield _PressedStack(own.stack, own.group, own.places, numbers, own.factors, _weights(own.stack))
        for patch in self.matrix.alone:
            part = self.matrix.parts[patch]
            group = next(i for i, members in enumerate(groups) if patch in members)
            place = np.array([groups[group].index(patch)])
            yield _PressedStack(part.stack, group, place, ONE + patch, part.rows[None], _weights(part.stack))


@dataclass(frozen=True, eq=False)
class HeldFace:
    """Hold the terms int r n . P u of a face. pull: (3, m), the weights times P n."""

    face: WeakFace
    pull: Array

    def add_volumes(self, u: OnPatches, result: OnPatches) -> None:
        """Add the integrals with each pressure of u (3, n_u, n_v, n_w) to a result (1, n_u, n_v, n_w) of each patch."""
        self.spread((self.pull * self.face.values_of(u.of(self.face.patches))).sum(axis=0)[None], result)

    def add_forces(self, p: OnPatches, result: OnPatches) -> None:
        """Add the integrals with each displacement of p (1, ..) to a result (4, n_u, n_v, n_w) of each patch."""
        self.spread(self.pull * self.face.values_of(p.of(self.face.patches)), result)

    def add_load(self, result: OnPatches) -> None:
        """Add the integrals of the given values, n . P g, with each pressure to a result (1, ..) of each patch."""
        self.spread((self.face.weights * self.face.normal * self.face.values).sum(axis=0)[None], result)

    def spread(self, values: Array, result: OnPatches) -> None:
        """Add the integrals of values (c, m), with weights, times each function to the first c of a result."""
        found = np.zeros_like(result.of(self.face.patches))
        target = np.moveaxis(found[:, : len(values)][:, :, *self.face.layers[0]], 1, -1)  # (k, n_b, n_c, c)
        target += (self.face.tables[0].T @ values.T).reshape(target.shape)
        result.add(self.face.patches, found)


def _weights(stack: PatchStack) -> Weights:
    firsts: Sequence[int] = np.unique(stack.kinds, return_index=True)[1].tolist()
    u, v, w = (np.stack([stack.rules[i].weights[axis] for i in firsts]) for axis in range(3))
    return u, v, w


@compiled
def roots(rows: Array, weights: Weights, kind: int, point: int, result: Array) -> None:
    """Write the roots of w |det J| on a plane to result (q_w, q_v).

    The determinant of R, J^-1 times this root, is the root times the weight w.
    """
    for q in range(result.shape[0]):
        for m in range(result.shape[1]):
            weight = weights[0][kind, point] * weights[1][kind, m] * weights[2][kind, q]
            a = rows[1, 1, q, m] * rows[2, 2, q, m] - rows[1, 2, q, m] * rows[2, 1, q, m]
            b = rows[1, 2, q, m] * rows[2, 0, q, m] - rows[1, 0, q, m] * rows[2, 2, q, m]
            c = rows[1, 0, q, m] * rows[2, 1, q, m] - rows[1, 1, q, m] * rows[2, 0, q, m]
            det = rows[0, 0, q, m] * a + rows[0, 1, q, m] * b + rows[0, 2, q, m] * c
            result[q, m] = abs(det) / weight


@compiled
def divergences(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    rows: Array,
    weights: Weights,
    result: Array,
) -> None:
    """Add the part of some patches and points of u to - int r div u; arguments as in `group_kernels.multiply_laws`.

    coefficients: (g, 3, n_u, n_v, n_w). result: (g, 1, n_u, n_v, n_w).
    """
    plane = rows.shape[4:]
    field, root = np.empty((4, *plane)), np.empty(plane)
    volume = np.zeros((4, *plane))
    for i in patches:
        source, own = coefficients[places[i]], of_kind(tables, kinds[i])
        for point in points:
            here = rows[i, point]
            volume[0] = 0.0
            for c in range(3):
                evaluate_plane(source[c], point, own, field)
                for q in range(plane[0]):
                    for a in range(3):
                        for m in range(plane[1]):
                            volume[0, q, m] -= here[a, c, q, m] * field[1 + a, q, m]
            roots(here, weights, kinds[i], point, root)
            volume[0] *= root
            spread_plane(volume, point, own, True, result[places[i], 0])


@compiled
def spread_pressures(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    rows: Array,
    weights: Weights,
    compliance: Array,
    result: Array,
) -> None:
    """Add the part of some patches and points of u to - int p div v and - int r p / lambda, as `divergences` does.

    coefficients: (g, 1, n_u, n_v, n_w). compliance: (k,). result: (g, 4, n_u, n_v, n_w).
    """
    plane = rows.shape[4:]
    field, root = np.empty((4, *plane)), np.empty(plane)
    for i in patches:
        source, total, own = coefficients[places[i], 0], result[places[i]], of_kind(tables, kinds[i])
        for point in points:
            here = rows[i, point]
            evaluate_plane(source, point, own, field)
            roots(here, weights, kinds[i], point, root)
            pull = -root * field[0]
            for c in range(3):
                for a in range(3):
                    field[1 + a] = pull * here[a, c]
                spread_plane(field, point, own, False, total[c])
            field[0] = compliance[i] * root * pull
            field[1:] = 0.0
            spread_plane(field, point, own, True, total[3])
