"""Finds how an asked quantity itself depends on the boundary, with the solution as it is.

An integral grows with its part of the body, a place on the boundary moves with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.orientation import FACES

from ..field_groups import FieldGroup
from ..forms.form import reaction
from ..quantities import at_places
from ..solution import Solution
from .boundary import BoundaryPiece, Values, curvature
from .functional import Flow, Functional, Integral, Reaction
from .geometry import TrueSurface
from .linearised import slopes_of
from .parts import Piece

ON_FACE = 1e-6  # in the parameters: a place as near to a face lies on it
STEP = 1e-4  # in the parameters: the difference by which the slope of a quantity along the normal is found


@dataclass(frozen=True, eq=False)
class OwnChange:
    """Hold an asked quantity J and a solution, with the value of J and the size of the part of which it is a mean."""

    functional: Functional
    solution: Solution
    value: float
    place: Array | None  # (3,), of a largest or smallest value, or that is asked for
    size: float = 1.0

    @classmethod
    def of(cls, functional: Functional, solution: Solution) -> "OwnChange":
        """Return the quantity of a solution."""
        value, at = functional.found(solution)
        asked = functional.ask.place if at is None else at
        if functional.ask.kind != "mean":
            return cls(functional, solution, value, None if asked is None else np.array(asked))
        size = sum(float(piece.weights.sum()) for piece in functional.part.pieces(solution))
        return cls(functional, solution, value, None, size)

    def density(self, piece: BoundaryPiece, z: Values) -> Array:
        """Return the change (m,) of J by a shift of the boundary along its normal, per area."""
        if isinstance(self.functional, Reaction):  # of the flux through a held face, for z = -1 there
            return np.einsum("cm,cdm,dm->m", piece.source - piece.u.reaction, piece.given.projector, z.u)
        if not isinstance(self.functional, Integral) or self.functional.part.on_boundary:
            return np.zeros(len(piece.weights))
        problem = piece.group.problem
        assert problem is not None
        quantity, c = self.functional.quantity_of(problem.form), problem.form.components
        share = self.functional.part.holds(np.asarray(piece.x)) / self.size
        values = np.ravel(piece.of_solution(quantity))
        inside = values - self.value if self.functional.ask.kind == "mean" else values
        of_grad = share * piece.of_solution(slopes_of(quantity))[-3 * c :].reshape(c, 3, -1)
        return share * inside - self._through_held(piece, of_grad)

    def _through_held(self, piece: BoundaryPiece, of_grad: Array) -> Array:
        """Return the part (m,) of the adjoint's flux through held faces that J itself makes up, of_grad (c, 3, m)."""
        pull = np.einsum("cam,am->cm", of_grad, piece.normal)
        slope = np.einsum("cdm,dam,am->cm", piece.given.projector, piece.u.grad, piece.normal)
        return np.asarray((pull * (slope - piece.given.value_slope)).sum(axis=0))

    def beside(self, surface: TrueSurface) -> float:
        """Return the change of J where it is that at a place, or an integral over a part of the boundary."""
        if self.place is not None:
            return self._of_place(self.place, surface)
        if not self.functional.part.on_boundary or not isinstance(self.functional, Integral | Flow):
            return 0.0
        return sum(self._of_face(piece, surface) for piece in self.functional.part.pieces(self.solution))

    def _of_face(self, piece: Piece, surface: TrueSurface) -> float:
        """Return the change of an integral over points of one face."""
        assert piece.normal is not None
        x = piece.group.maps.at(piece.rows, piece.places)
        offset = surface.offsets(x, np.ascontiguousarray(piece.normal.T))
        if isinstance(self.functional, Flow):  # its divergence is reaction minus source
            return float((piece.weights * offset) @ self._divergence(piece))
        jacobian = piece.group.maps.slopes_at(piece.rows, piece.places)
        axis = next(a for a in range(3) if np.isin(piece.places[:, a], (0.0, 1.0)).all())
        bent = curvature(piece.group, piece.rows, piece.places, axis, jacobian, piece.normal)
        inward = -np.linalg.solve(jacobian, piece.normal.T[:, :, None])[:, :, 0]
        inward *= STEP / np.abs(inward).max(axis=1, keepdims=True)
        inner = np.clip(piece.places + inward, 0.0, 1.0)
        values, behind = (self._values(piece.group, piece.rows, where) for where in (piece.places, inner))
        depth = np.linalg.norm(x - piece.group.maps.at(piece.rows, inner), axis=1)
        mean = self.value if self.functional.ask.kind == "mean" else 0.0
        change = (values - behind) / depth + bent * (values - mean)
        return float((piece.weights * offset) @ change) / self.size

    def _divergence(self, piece: Piece) -> Array:
        """Return the divergence (m,) of the flux that flows, by the equations."""
        problem = piece.group.problem
        assert problem is not None
        component = "xyz".index(self.functional.ask.direction) if self.functional.ask.direction else 0

        def found(u: Array, grad: Array, x: Array) -> Array:
            return np.asarray(reaction(problem.form, u, grad, x) - problem.source_at(x))[component]

        return at_places(piece.group, found, piece.rows, piece.places)

    def _values(self, group: FieldGroup, rows: IntArray, where: Array) -> Array:
        assert group.problem is not None
        return np.ravel(at_places(group, self.functional.quantity_of(group.problem.form), rows, where))

    def _of_place(self, place: Array, surface: TrueSurface) -> float:
        """Return the change of a value at a place that moves with the boundary; 0 for a place inside."""
        body = self.solution.body
        owners, where = body.locate(place)
        if owners[0] < 0:
            return 0.0
        groups = self.functional.part.groups(self.solution)
        group = next(one for one in groups if owners[0] in one.numbers)
        rows, jacobian = np.flatnonzero(group.numbers == owners[0]), body.jacobian(owners, where)[0]
        normals = _normals(jacobian, where[0], body.glued[owners[0]])
        if not len(normals):
            return 0.0
        offsets = surface.offsets(np.repeat(body.points(owners, where), len(normals), axis=0), normals)
        shift = np.linalg.solve(jacobian, np.linalg.lstsq(normals, offsets, rcond=None)[0])
        size = float(np.abs(shift).max())
        if size == 0.0:
            return 0.0
        step = shift * min(1.0, STEP / size)
        is_inside = np.all((where[0] + step >= 0.0) & (where[0] + step <= 1.0))
        way = 1.0 if is_inside else -1.0
        here, there = (self._values(group, rows, np.clip(where + share * step, 0.0, 1.0)) for share in (0.0, way))
        return float(way * (there - here)[0] * size / np.abs(step).max())


def _normals(jacobian: Array, where: Array, glued: Sequence[bool]) -> Array:
    """Return the outward normals (k, 3) of the outer faces of a patch that a place lies on."""
    inverse = np.linalg.inv(jacobian)
    found = [
        inverse[axis] * (1.0 if side else -1.0)
        for face, (axis, side) in enumerate(FACES)
        if not glued[face] and abs(where[axis] - side) < ON_FACE
    ]
    rows = np.reshape(found, (-1, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)
