"""Judges the edges of a body: the angle of the material, how both faces are held, and the exponent that follows."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body

from ..field import Points
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.elasticity import Elasticity
from .edges import ACROSS, INSET, PatchEdges, across, edges_of, outward
from .held import Supports
from .spans import SpanLengths
from .wedge import REGULAR, Sector, exponent

SMOOTH = 10.0  # degrees by which faces of a smooth surface may bend where two patches meet; of 40 CAD parts all are
# within 5, and re-entrant edges begin at 190
DIFFER = 0.3  # of two projectors: the norm of the difference from which on two faces are held in different ways
SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")
_ALIKE = 1e-3  # share by which coefficients of one material may differ


@dataclass(frozen=True, eq=False)
class JudgedEdges:
    """Judge the edges of a body at s samples each. Arrays (e, ..) are of its edges with two outer faces."""

    body: Body
    problems: Sequence[BoundaryValueProblem]
    supports: Supports
    spans: SpanLengths

    @cached_property
    def of_patches(self) -> PatchEdges:
        """Return the edges of patches at the boundary."""
        return edges_of(self.body, self.spans.most)

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """Return the patches' edges (e, 2) at the two outer faces of each edge, and which of their faces (e, 2)."""
        of = self.of_patches
        rows, columns = np.nonzero(~self.body.glued.ravel()[of.faces])
        order = np.argsort(of.numbers[rows], kind="stable")
        rows, columns = rows[order], columns[order]
        _, first, counts = np.unique(of.numbers[rows], return_index=True, return_counts=True)
        first = first[counts == 2]
        places = np.stack([first, first + 1], axis=1)
        return rows[places], columns[places]

    @cached_property
    def _rank(self) -> IntArray:
        """Return the place of each patch's edge among the edges with two outer faces, -1 without one."""
        of, rows = self.of_patches, self.pairs[0]
        ranks = np.full(of.numbers.max(initial=0) + 1, -1)
        ranks[of.numbers[rows[:, 0]]] = np.arange(len(rows))
        return np.asarray(ranks[of.numbers])

    @cached_property
    def angles(self) -> Array:
        """Return the angles of the material (e, s) in degrees; 180 where the surface is smooth."""
        of, rank = self.of_patches, self._rank
        total = np.zeros((len(self.pairs[0]), of.angles.shape[1]))
        np.add.at(total, rank[rank >= 0], np.degrees(of.angles[rank >= 0]))
        return np.where(np.abs(total - 180.0) <= SMOOTH, 180.0, total)

    @cached_property
    def sides(self) -> Array:
        """Return the sides across each patch's edge (n, 2, s, 3) of the spans there."""
        of = self.of_patches
        spans = self.spans.outer[of.patches[:, None], ACROSS[of.axes], of.sides]
        return of.inward * spans[..., None, None]

    def around(self, e: IntArray) -> tuple[IntArray, IntArray]:
        """Return the patches' edges (k,) around edges e (m,), and the place (k,) in e of each."""
        order = np.argsort(self._rank, kind="stable")
        first, last = (np.searchsorted(self._rank[order], e, side=side) for side in SIDES)
        places = np.repeat(np.arange(len(e)), last - first)
        inside = np.arange(len(places)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
        return order[first[places] + inside], places

    @cached_property
    def held(self) -> tuple[IntArray, Array]:
        """Return the codes (e, 2, s) of the conditions on both faces, and the projectors (e, 2, s, c, c)."""
        of, (rows, columns) = self.of_patches, self.pairs
        count, components = of.angles.shape[1], self.problems[0].form.components
        shape = *rows.shape, count
        if self.supports.hold_nothing:
            return np.zeros(shape, dtype=np.int64), np.zeros((*shape, components, components))
        flat, column = rows.ravel(), columns.ravel()
        faces = of.faces[flat, column]
        axes = ACROSS[of.axes[flat]]
        parameters, each = np.zeros((len(flat), count, 3)), np.arange(len(flat))
        parameters[each, :, of.axes[flat]] = of.along[flat]
        parameters[each, :, axes[each, column]] = of.sides[flat][each, column][:, None]
        inset = np.where(of.sides[flat][each, 1 - column] == 1, 1.0 - INSET, INSET)
        parameters[each, :, axes[each, 1 - column]] = inset[:, None]
        faces = np.repeat(faces, count)
        x, normal = outward(self.body, faces, parameters.reshape(-1, 3))
        codes = self.supports.codes(faces, np.ascontiguousarray(x.T), np.ascontiguousarray(normal.T))
        projectors = self.supports.projectors(codes, normal.T)
        return codes.reshape(shape), projectors.reshape(*shape, components, components)

    @cached_property
    def _frames(self) -> Array:
        """Return at both faces the directions r along the face, theta and z: (e, 2, s, 3, 3), columns."""
        of, (rows, columns) = self.of_patches, self.pairs
        radial = across(of.inward[rows, 1 - columns], of.tangents[rows])
        into = across(of.inward[rows, columns], of.tangents[rows])
        normal = np.cross(of.tangents[rows], radial)
        normal *= np.sign((normal * into).sum(axis=-1, keepdims=True))
        normal[:, 1] *= -1.0  # theta runs from the first face into the body, and out of it at the second
        return np.stack([radial, normal, np.cross(radial, normal)], axis=-1)

    @cached_property
    def _coefficients(self) -> Array:
        """Return shear modulus and Poisson's ratio (n, 2) at patches' edges, of scalar laws the factor and 0."""
        of, found = self.of_patches, np.ones((len(self.of_patches.patches), 2))
        middle, parameters = of.points.shape[1] // 2, np.zeros((len(found), 3))
        np.put_along_axis(parameters, ACROSS[of.axes], of.sides.astype(np.float64), axis=1)
        np.put_along_axis(parameters, of.axes[:, None], of.along[:, middle, None], axis=1)
        kinds: dict[Any, list[int]] = defaultdict(list)
        for row, patch in enumerate(of.patches.tolist()):
            kinds[self.problems[patch].in_volume].append(row)
        for rows in kinds.values():
            form = self.problems[int(of.patches[rows[0]])].form
            if isinstance(form, Elasticity):
                lam, mu = form.constants
                found[rows] = mu, 0.5 * lam / (lam + mu)
            elif len(kinds) > 1:
                x = Points.at(np.ascontiguousarray(of.points[rows, middle].T), parameters[rows])
                found[rows] = np.stack([form.tensor(x)[[0, 3, 5]].mean(axis=0), np.zeros(len(rows))], axis=1)
        return found

    @cached_property
    def is_mixed(self) -> Mask:
        """Return whether several materials meet at each edge (e,)."""
        rank, own = self._rank, self._coefficients
        low, high = np.full((len(self.pairs[0]), 2), np.inf), np.full((len(self.pairs[0]), 2), -np.inf)
        np.minimum.at(low, rank[rank >= 0], own[rank >= 0])
        np.maximum.at(high, rank[rank >= 0], own[rank >= 0])
        return np.asarray((high - low > _ALIKE * np.abs(high)).any(axis=1))

    @cached_property
    def differ(self) -> Mask:
        """Return whether the two faces are held in different ways (e, s)."""
        _, projectors = self.held
        return np.asarray(np.linalg.norm(projectors[:, 0] - projectors[:, 1], axis=(-2, -1)) > DIFFER)

    @cached_property
    def exponents(self) -> Array:
        """Return the exponents (e, s)."""
        projectors, angles = self.held[1], self.angles
        found = np.full(angles.shape, REGULAR)
        is_sharp = angles > 180.0
        e, s = np.nonzero(is_sharp | self.is_mixed[:, None] | self.differ)
        if not len(e):
            return found
        local = np.einsum("mfia,mfij,mfjb->mfab", self._local(e, s), projectors[e, :, s], self._local(e, s))
        keys = np.concatenate([angles[e, s][:, None], 10.0 * local.reshape(len(e), -1)], axis=1).round()
        extra = np.where(self.is_mixed[e], e + 1, 0)[:, None]
        _, first, labels = np.unique(np.hstack([keys, extra]), axis=0, return_index=True, return_inverse=True)
        values = [self._exponent(int(e[i]), int(s[i]), local[i]) for i in first]
        found[e, s] = np.array(values)[labels.ravel()]
        return found

    def _local(self, e: IntArray, s: IntArray) -> Array:
        """Return the axes (m, 2, c, c) in which projectors are those of the wedge."""
        if self.problems[0].form.components == 3:
            return self._frames[e, :, s]
        return np.broadcast_to(np.eye(self.problems[0].form.components), (len(e), 2, *[self.held[1].shape[-1]] * 2))

    def _exponent(self, e: int, s: int, projectors: Array) -> float:
        """Return the exponent at a sample of an edge. projectors: (2, c, c), on its two faces in the wedge's axes."""
        rows = self.pairs[0][e]
        own = np.flatnonzero(self._rank == e)
        angles, coefficients = self.of_patches.angles[own, s], self._coefficients
        first, last = coefficients[rows[0]], coefficients[rows[1]]
        of_first = np.isclose(coefficients[own], first, rtol=_ALIKE).all(axis=1)
        if not self.is_mixed[e]:
            parts = [(np.radians(self.angles[e, s]), first)]
        elif np.isclose(first, last, rtol=_ALIKE).all():  # the others lie between, in the middle as far as is known
            middle = coefficients[own[~of_first][0]]
            half = angles[of_first].sum() / 2.0
            parts = [(half, first), (angles[~of_first].sum(), middle), (half, last)]
        else:
            parts = [(angles[of_first].sum(), first), (angles[~of_first].sum(), last)]
        shear, is_elastic = parts[0][1][0], isinstance(self.problems[0].form, Elasticity)
        sectors = (
            Sector(round(float(angle), 2), float(one[0] / shear), float(one[1]) if is_elastic else None)
            for angle, one in parts
        )
        held = [_nearest(one) if is_elastic else (float(np.trace(one) > 0.5),) for one in projectors]
        return exponent(tuple(sectors), held[0], held[1])


def _nearest(projector: Array) -> tuple[float, ...]:
    """Return the projector nearest to a matrix (3, 3), row by row."""
    values, vectors = np.linalg.eigh(0.5 * (projector + projector.T))
    chosen = vectors[:, values > 0.5]
    return tuple((chosen @ chosen.T).round(2).ravel().tolist())
