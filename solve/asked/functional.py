"""Defines Functional, an asked quantity as a number of a solution, and makes it from an ask on a body."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, in_brackets
from parameterize.quality.distances import nearest_on_boundary
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.sampled_boundary import SampledBoundary

from ..answer import Answer, Dimension
from ..ask import Ask, Place
from ..field import FieldOnBody
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import Form, Quantity
from ..forms.frame import UnitFrame
from .linearised import joined, sampled
from .named import demand_fit, dimension_of, named
from .parts import Part, Piece, Scattered
from .samples import Samples
from .search import Excluded, extreme_inside, extreme_on_boundary
from .supports import supports_in

NEAR = 0.01  # of the body's size: a place no farther outside is that of the nearest point, for a spline is not its part
ON_IT = 1e-6  # of the body's size: a distance to the nearest point that is not worth telling
BALL = 3  # Gauss points a direction in the box of one span around a largest value, for its linearisation


@dataclass(frozen=True, eq=False)
class Functional(ABC):
    """Describe an asked quantity J on a body. said: what a reader should know of it; "" for nothing."""

    ask: Ask
    part: Part
    said: str

    @property
    def form(self) -> Form:
        """Return the law, of several solids that of the first patch."""
        return self.part.problems[0].form

    @property
    def dimension(self) -> Dimension:
        """Return what the quantity measures."""
        return dimension_of(self.ask, self.form)

    @abstractmethod
    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return J of a solution, and the point of a largest or smallest value.

        Raises ValueError where there is none.
        """

    def value(self, solution: FieldOnBody) -> float:
        """Return J of a solution: of any field on the body, but for reactions, which need its report."""
        return self.found(solution)[0]

    def samples(self, solution: FieldOnBody) -> Samples | None:
        """Return the linearisation at a solution; None where it is no sum over points."""
        return None

    def answer(self, solution: FieldOnBody) -> Answer:
        """Return the answer without an interval; no number, and the reason, where a solution has no such number."""
        try:
            value, at = self.found(solution)
        except ValueError as error:
            return Answer(self.ask.text, math.nan, why=str(error).removeprefix(f"{self.ask.role}: "))
        return Answer(self.ask.text, value, at=at, said=self.said, dimension=self.dimension)

    def quantity_of(self, form: Form) -> Quantity:
        """Return the quantity of a law that is evaluated at points."""
        return form.energy if self.ask.kind == "energy" else named(form, self.ask.quantity)


@dataclass(frozen=True, eq=False)
class AtPlace(Functional):
    """A quantity at a place of a patch. unknown: why it has no interval; "" where it may have one."""

    patch: int
    parameters: Array  # (3,)
    unknown: str = ""

    def _piece(self, solution: FieldOnBody) -> Piece:
        for group in self.part.groups(solution):
            if len(rows := np.flatnonzero(group.numbers == self.patch)):
                return Scattered(group, rows, self.parameters[None], np.ones(1))
        raise AssertionError("every patch is in a group")

    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return the value of the spline there; of a derivative no average."""
        return float(np.ravel(self._piece(solution).values(self.quantity_of))[0]), None

    def samples(self, solution: FieldOnBody) -> Samples:
        """Return the one point."""
        return sampled([(self._piece(solution), np.ones(1))], self.quantity_of)


@dataclass(frozen=True, eq=False)
class Integral(Functional):
    """The integral or the mean of a quantity over a part of the body or of its boundary."""

    def _integrals(self, solution: FieldOnBody) -> tuple[float, float]:
        """Return the integrals of the quantity and of 1."""
        total = size = 0.0
        for piece in self.part.pieces(solution):
            total += float(np.ravel(piece.values(self.quantity_of)) @ piece.weights)
            size += float(piece.weights.sum())
        return total, size

    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return the integral, or the mean."""
        total, size = self._integrals(solution)
        return (total / size if self.ask.kind == "mean" else total), None

    def samples(self, solution: FieldOnBody) -> Samples:
        """Return the points of the quadrature."""
        pieces = list(self.part.pieces(solution))
        size = sum(float(piece.weights.sum()) for piece in pieces) if self.ask.kind == "mean" else 1.0
        return sampled([(piece, piece.weights / size) for piece in pieces], self.quantity_of)


@dataclass(frozen=True, eq=False)
class Extreme(Functional):
    """The largest or the smallest value of a quantity in a part, without excluded points, where it is infinite.

    unknown: why it has no interval; "" where it may have one.
    """

    is_excluded: Excluded | None = None
    unknown: str = ""

    def _search(self, solution: FieldOnBody) -> tuple[float, Place, int, Array]:
        """Return the value, its point, patch and parameters."""
        search = extreme_on_boundary if self.part.on_boundary else extreme_inside
        try:
            return search(self.part, solution, self.quantity_of, self.ask.kind == "max", self.is_excluded)
        except ValueError as error:
            raise ValueError(f"{self.ask.role}: {error}") from None

    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return the value and its point."""
        return self._search(solution)[:2]

    def samples(self, solution: FieldOnBody) -> Samples:
        """Return the points of a mean over a box around the place, of one span a direction, cut off by its patch."""
        _, _, patch, place = self._search(solution)
        at = AtPlace(self.ask, self.part, self.said, patch, place)._piece(solution)
        spans = [_span(knots, t) for knots, t in zip(at.group.values.knots, place, strict=True)]
        low, high = np.maximum(place - 0.5 * np.array(spans), 0.0), np.minimum(place + 0.5 * np.array(spans), 1.0)
        t, weights = np.polynomial.legendre.leggauss(BALL)
        unit = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
        places = 0.5 * (low + high) + 0.5 * (high - low) * unit
        rows = np.repeat(at.rows, len(places))
        size = np.abs(np.linalg.det(at.group.maps.slopes_at(rows, places)))
        own = np.einsum("i,j,k->ijk", weights, weights, weights).ravel() * size
        own /= own.sum()
        return sampled([(Scattered(at.group, rows, places, own), own)], self.quantity_of)


@dataclass(frozen=True, eq=False)
class Reaction(Functional):
    """The reactions of supports, by their names in `report.balance`, added up; faces: as "u0", whose supports count."""

    roles: tuple[str, ...]
    faces: tuple[str, ...]

    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return the sum of the reactions, which follow from the residual and are as accurate as an energy."""
        balance = getattr(getattr(solution, "report", None), "balance", None)
        if balance is None:
            raise ValueError(f"{self.ask.role}: the solution has no balance of loads and reactions")
        own = [force for role, force in balance.reactions.items() if role in self.roles or self.is_on_face(role)]
        return float(sum(force[self.component] for force in own)), None

    @property
    def component(self) -> int:
        """Return the component of u along which the reaction is asked for."""
        return "xyz".index(self.ask.direction) if self.ask.direction else 0

    def is_on_face(self, role: str) -> bool:
        """Return whether a reaction of that name in a balance is that of one of the faces."""
        return any(role == face or role.endswith(f"_{face}") for face in self.faces)


@dataclass(frozen=True, eq=False)
class Flow(Functional):
    """The integral of flux . n over a part of the boundary, which flows into the body there."""

    def found(self, solution: FieldOnBody) -> tuple[float, Place | None]:
        """Return the integral."""
        total = 0.0
        for piece in self.part.pieces(solution):
            assert piece.normal is not None
            total += float((self._flux(piece) * piece.normal).sum(axis=0) @ piece.weights)
        return total, None

    @property
    def _component(self) -> int:
        return "xyz".index(self.ask.direction) if self.ask.direction else 0

    def _flux(self, piece: Piece) -> Array:
        return piece.values(lambda form: form.whole_flux)[self._component]

    def samples(self, solution: FieldOnBody) -> Samples:
        """Return the points of the quadrature."""
        return joined([self._of_piece(piece) for piece in self.part.pieces(solution)])

    def _of_piece(self, piece: Piece) -> Samples:
        normal = piece.normal
        assert normal is not None

        def through(form: Form) -> Quantity:
            return lambda u, grad, x: (np.asarray(form.whole_flux(u, grad, x))[self._component] * normal).sum(axis=0)

        return sampled([(piece, piece.weights)], through)


def functional(
    ask: Ask, problem: BoundaryValueProblem, body: BodyLike, is_excluded: Excluded | None = None
) -> Functional:
    """Return an ask as a functional of solutions of a problem on a body.

    is_excluded: returns the mask (m,) of points (m, 3) at which no largest or smallest value is looked for. Raises
    ValueError where the ask is not one of the problem, or not one of the body.
    """
    demand_fit(ask, problem)
    glued = as_body(body)
    placed = problem.on(glued)
    surface = next((one.region.surface for one in placed.conditions if one.region.surface is not None), None)
    is_scaled = ask.region is not None and ask.region.is_scaled
    ask = ask.placed(UnitFrame.of(glued) if is_scaled else None, surface)
    try:
        return _made(ask, placed, glued, is_excluded)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(ask.role) else f"{ask.role}: {text}") from None


def _made(ask: Ask, problem: BoundaryValueProblem, body: Body, is_excluded: Excluded | None) -> Functional:
    problems, region = problem.on_patches(body), ask.region
    _demand_faces(ask, body)
    on_boundary = ask.is_on_boundary or ask.kind == "flow"
    part = Part(body, problems, region, on_boundary)
    if ask.kind == "at":
        return _at_place(ask, part)
    if ask.kind in ("reaction", "flow"):
        found = supports_in(ask, problem, body)
        if found is not None:
            return Reaction(ask, part, found.said, found.roles, found.faces)
        part.demand_some()
        return Flow(ask, part, "into the body, by quadrature of the flux")
    part.demand_some()
    if ask.kind == "energy":
        thermal = "half of stress times strain, without the thermal strain"
        return Integral(
            ask, part, thermal if problem.form.has_initial_flux else "1/2 a(u, u), the energy inside the body"
        )
    where = "" if region is None else f"over a part of the {'boundary' if on_boundary else 'body'}"
    if ask.kind in ("mean", "integral"):
        return Integral(ask, part, where)
    return Extreme(ask, part, where, is_excluded)


def _demand_faces(ask: Ask, body: Body) -> None:
    """Raise ValueError for faces of patches in an ask's region that are no outer faces of the body."""
    outer = {body.face_name(*face) for face in body.outer_faces}
    for name in () if ask.region is None else ask.region.patch_faces:
        if name not in outer:
            raise ValueError(f"{name} is no outer face of the body")


def _at_place(ask: Ask, part: Part) -> AtPlace:
    """Return the functional of a place; of one a little outside, that of the nearest point of the boundary."""
    assert ask.place is not None
    point = np.array([ask.place])
    owners, where = part.body.locate(point)
    if owners[0] >= 0:
        return AtPlace(ask, part, "", int(owners[0]), where[0])
    owners, where, distance = nearest_on_boundary(point, part.body, SampledBoundary.of(part.body))
    nearest = in_brackets(part.body.points(owners, where)[0])
    if distance[0] > NEAR * part.body.size:
        raise ValueError(
            f"the place lies outside of the body, {distance[0]:.4g} from it; its nearest point is {nearest}"
        )
    is_told = distance[0] > ON_IT * part.body.size
    said = f"at {nearest}, the nearest point of the body, {distance[0]:.2g} away" if is_told else ""
    return AtPlace(ask, part, said, int(owners[0]), where[0])


def _span(knots: Array, t: float) -> float:
    """Return the length of the span at a parameter."""
    ends = np.unique(knots)
    place = int(np.clip(np.searchsorted(ends, t, side="right") - 1, 0, len(ends) - 2))
    return float(ends[place + 1] - ends[place])
