"""Writes input files of CalculiX and Abaqus: curved hexahedra of 20 nodes, sets, materials, supports, loads and a step.

CalculiX CrunchiX user's manual, version 2.20, "Input deck format". The elements are proved to be unfolded
(`element_proof`). Loads are forces at nodes (*CLOAD, of heat *CFLUX) whose sum is that of the solve, and exchanges are
films on faces (*FILM). A number has at most 20 characters, of which CalculiX reads no more.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.surface.part import PartSurface
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.elasticity import Elasticity
from solve.forms.poisson import Poisson
from solve.patch_system import PatchProblem

from ..errors import InputError, input_errors
from .element_loads import Films, nodal_loads, problems_on
from .element_proof import proved
from .element_shapes import SHAPES, ElementShape
from .element_supports import Held, faces_of_regions, held_nodes
from .elements import Elements, cut

log = logging.getLogger(__name__)

SIDES = ("S6", "S4", "S3", "S5", "S1", "S2")  # the faces u0, u1, v0, v1, w0, w1 of an element
LONGEST = 60  # letters of a name; CalculiX takes 80, of which its own endings are some
IN_A_ROW = 15  # numbers; CalculiX reads 16
TEMPERATURE = 11  # CalculiX's degree of freedom
# Fields of the problems that are written; another one that is given is refused by its name.
WRITTEN = {
    "body_force", "displacement", "traction", "young", "poisson_ratio", "conditions", "density", "gravity", "spin",
    "acceleration", "expansion", "yield_strength", "source", "boundary", "kappa", "reaction", "neumann", "robin",
    "exact",
}  # fmt: skip
VARIES = 1e-9  # of its size, by which a conductivity may vary on a patch


@dataclass(frozen=True, eq=False)
class Deck:
    """Hold what an input file says.

    elements: as they are written, proved. shape: of all of them. numbers: (n,), of the nodes in the file, 0 for a node
    of the lattice that the shape does not have. forces: (n, c). films: of heat. held: equations of the supports. sets:
    elements and their own faces by the names of regions. materials: (patches,), of each patch, and their lines.
    """

    elements: Elements
    shape: ElementShape
    numbers: IntArray
    problem: BoundaryValueProblem | None
    forces: Array
    films: Films | None
    held: Held
    sets: dict[str, tuple[IntArray, IntArray]]
    materials: IntArray
    lines: list[list[str]]
    halved: int

    @classmethod
    def of(
        cls,
        body: BodyLike,
        problem: BoundaryValueProblem | None = None,
        part: PartSurface | None = None,
        *,
        parts: int = 1,
        element: str = "C3D20",
    ) -> Deck:
        """Return the deck of a body, and of a problem on it, if there is one.

        part: the surface of the part, whose groups become sets. parts: elements a span of the map and direction.
        element: one of SHAPES. Raises InputError for a problem that CalculiX's input cannot state.
        """
        if element not in SHAPES:
            raise InputError(f"element {element!r}: choose one of {', '.join(SHAPES)}")
        whole, shape = as_body(body), SHAPES[element]
        if any(patch.weights is not None for patch in whole):
            log.info("the body is rational: its elements pass through points of it")
        elements, halved = proved(Elements.of(whole, shape.degree, cut(whole, parts)), shape)
        numbers = np.zeros(len(elements.points), dtype=np.int64)
        used = np.unique(shape.chosen(elements.cells))
        numbers[used] = np.arange(1, len(used) + 1)
        held, forces, films = Held([], {}), np.zeros((len(numbers), 0)), None
        materials = whole.solids.numbers
        lines: list[list[str]] = [[] for _ in range(int(materials.max()) + 1)]
        placed = problem
        if problem is not None:
            _refuse(problem)
            with input_errors():
                placed, patches = problems_on(elements, problem)
                materials, lines = _materials(elements.body, patches)
                held = held_nodes(elements, patches)
                forces, films = nodal_loads(elements, shape, patches, problem.form.components)
        sets = faces_of_regions(elements, placed, part)
        return cls(elements, shape, numbers, placed, forces, films, held, sets, materials, lines, halved)

    @property
    def is_heat(self) -> bool:
        """Return whether the problem is one of heat."""
        return isinstance(self.problem, Poisson)

    def text(self) -> Iterator[str]:
        """Yield the lines of the file."""
        yield "*HEADING"
        yield f"{len(self.elements)} certified hexahedra {self.shape.name} by iga-nn"
        yield from self._mesh()
        yield from self._sets()
        if self.problem is not None:
            yield from self._sections()
            yield from self._step()

    def _mesh(self) -> Iterator[str]:
        used = np.flatnonzero(self.numbers)
        yield "*NODE, NSET=NALL"
        for number, point in zip(self.numbers[used].tolist(), self.elements.points[used].tolist(), strict=True):
            yield f"{number}, " + ", ".join(map(_real, point))
        cells = self.numbers[self.shape.chosen(self.elements.cells)]
        owners = self.materials[self.elements.owners]
        for material in range(len(self.lines)):
            yield f"*ELEMENT, TYPE={self._type}, ELSET=MATERIAL_{material + 1}"
            for element in np.flatnonzero(owners == material).tolist():
                row = [element + 1, *cells[element].tolist()]
                yield from _rows(row)
        yield "*ELSET, ELSET=EALL"
        yield from (f"MATERIAL_{material + 1}," for material in range(len(self.lines)))
        solids = self.elements.body.solids
        for number, label in enumerate(solids.labels if solids.are_several else ()):
            yield f"*ELSET, ELSET=SOLID_{number + 1}"
            yield f"** {label}"
            yield from _rows((np.flatnonzero(solids.numbers[self.elements.owners] == number) + 1).tolist())

    @property
    def _type(self) -> str:
        return self.shape.name

    def _sets(self) -> Iterator[str]:
        """Yield the nodes that supports hold, and the faces and nodes of regions and groups."""
        for name, (elements, faces) in self.named.items():
            yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
            yield from (f"{e + 1}, {SIDES[f]}" for e, f in zip(elements.tolist(), faces.tolist(), strict=True))
            yield f"*NSET, NSET={name}_NODES"
            yield from _rows(self._nodes(elements, faces))

    @property
    def named(self) -> dict[str, tuple[IntArray, IntArray]]:
        """Return the faces of regions by names that the file may have."""
        found: dict[str, tuple[IntArray, IntArray]] = {}
        for name, rows in self.sets.items():
            plain = re.sub(r"\W+", "_", re.sub(r"-(?=[\d.])", " minus ", name)).upper().strip("_")[:LONGEST] or "GROUP"
            plain = plain if plain[0].isalpha() else f"GROUP_{plain}"
            again = sum(1 for other in found if other == plain or other.startswith(f"{plain}_AGAIN"))
            found[plain if not again else f"{plain}_AGAIN{again}"] = rows
        return found

    def _nodes(self, elements: IntArray, faces: IntArray) -> list[int]:
        """Return the numbers of the nodes on faces of elements, ascending."""
        cells, found = self.elements.cells, [np.empty(0, dtype=np.int64)]
        for face in range(len(SIDES)):
            axis, side = divmod(face, 2)
            found.append(np.take(cells[elements[faces == face]], -side, axis=1 + axis).ravel())
        numbers = np.unique(self.numbers[np.concatenate(found)])
        return numbers[numbers > 0].tolist()

    def _sections(self) -> Iterator[str]:
        for material, lines in enumerate(self.lines):
            yield f"*MATERIAL, NAME=MATERIAL_{material + 1}"
            yield from lines
        for material in range(len(self.lines)):
            yield f"*SOLID SECTION, ELSET=MATERIAL_{material + 1}, MATERIAL=MATERIAL_{material + 1}"
        for node, terms, value in self.held.rows:
            number = int(self.numbers[node])
            if len(terms) > 1 and number:
                if value != 0.0:
                    raise InputError(
                        "a displacement other than zero along a normal that is no axis: CalculiX's equations have "
                        "none; give it as fix with three components"
                    )
                yield "*EQUATION"
                yield str(len(terms))
                yield from _rows([f"{number}, {dof + 1}, {_real(factor)}" for dof, factor in terms], 4)

    def _step(self) -> Iterator[str]:
        yield "*STEP"
        yield from ["*HEAT TRANSFER, STEADY STATE"] if self.is_heat else ["*STATIC"]
        single = [(node, terms[0][0], value) for node, terms, value in self.held.rows if len(terms) == 1]
        single = [row for row in single if self.numbers[row[0]]]
        if single:
            yield "*BOUNDARY"
        for node, dof, value in single:
            freedom = TEMPERATURE if self.is_heat else dof + 1
            yield f"{self.numbers[node]}, {freedom}, {freedom}, {_real(value)}"
        rows = np.argwhere(self.forces != 0.0)
        if len(rows):
            yield "*CFLUX" if self.is_heat else "*CLOAD"
        for node, component in rows.tolist():
            freedom = TEMPERATURE if self.is_heat else component + 1
            yield f"{self.numbers[node]}, {freedom}, {_real(self.forces[node, component])}"
        if self.is_heat and self.films is not None and len(self.films.elements):
            yield "*FILM"
            films = self.films
            for element, face, factor, outside in zip(
                films.elements.tolist(), films.faces.tolist(), films.coefficients, films.outside, strict=True
            ):
                yield f"{element + 1}, F{SIDES[face][1:]}, {_real(outside)}, {_real(factor)}"
        yield from ["*NODE FILE", "NT", "*EL FILE", "HFL"] if self.is_heat else ["*NODE FILE", "U", "*EL FILE", "S, E"]
        yield "*END STEP"


def write_calculix(
    path: Path,
    body: BodyLike,
    problem: BoundaryValueProblem | None = None,
    part: PartSurface | None = None,
    *,
    parts: int = 1,
    element: str = "C3D20",
) -> Deck:
    """Write an input file, and return what it says. Raises as `Deck.of`, and OSError."""
    if problem is None:
        log.warning("no solution with a known problem: the file has mesh and sets, but no materials and no step")
    deck = Deck.of(body, problem, part, parts=parts, element=element)
    path.write_text("\n".join(deck.text()) + "\n", encoding="utf-8")
    return deck


def _refuse(problem: BoundaryValueProblem) -> None:
    """Raise InputError for a problem that is not written, with the name of what is not."""
    if not isinstance(problem, Elasticity | Poisson) or type(problem) not in (Elasticity, Poisson):
        raise InputError(f"{type(problem).__name__} is not written for CalculiX: elasticity and heat are")
    for one in (one for one in fields(problem) if one.init):
        default = one.default_factory() if one.default_factory is not MISSING else one.default
        given = getattr(problem, one.name, default)
        if one.name not in WRITTEN and given is not default and given != default:
            raise InputError(f"{one.name} is not written for CalculiX: leave it out, or export --to vtk")
    for condition in problem.conditions:
        if condition.factor is not None and isinstance(problem, Elasticity):
            raise InputError(f"{condition.role} is not written for CalculiX: a spring is no load and holds no node")
    if problem.fixes_nothing and not problem.conditions and not problem.dirichlet:
        raise InputError("no support holds the body: CalculiX's matrix would be singular")


def _materials(body: Body, patches: Sequence[PatchProblem]) -> tuple[IntArray, list[list[str]]]:
    """Return the material of each patch (patches,), and the lines of each."""
    labels: dict[tuple[str, ...], int] = {}
    found = np.empty(len(body), dtype=np.int64)
    for number, patch in enumerate(patches):
        problem = patch.problem
        lines = _elastic(problem) if isinstance(problem, Elasticity) else _conducting(number, patch)
        found[number] = labels.setdefault(tuple(lines), len(labels))
    return found, [list(lines) for lines in labels]


def _elastic(problem: Elasticity) -> list[str]:
    """Return the lines of an isotropic material. Raises InputError for another one."""
    young, ratio = problem.young, problem.poisson_ratio
    if not isinstance(young, int | float) or not isinstance(ratio, int | float):
        raise InputError("an orthotropic material is not written for CalculiX: its axes may turn from point to point")
    density = ["*DENSITY", _real(problem.density)] if isinstance(problem.density, int | float) else []
    return ["*ELASTIC", f"{_real(float(young))}, {_real(float(ratio))}", *density]


def _conducting(number: int, patch: PatchProblem) -> list[str]:
    """Return the lines of a conductivity. Raises InputError where it varies, or isn't there alone."""
    problem = patch.problem
    assert isinstance(problem, Poisson)
    x = np.moveaxis(patch.volume.control_points.reshape(-1, 3), -1, 0)
    if problem.has_reaction and np.any(problem.mass(x)):
        raise InputError("reaction is not written for CalculiX: leave it out")
    kappa = problem.data["kappa"](x) if "kappa" in problem.data else np.ones((1, 1))
    if np.ptp(kappa, axis=1).max() > VARIES * np.abs(kappa).max():
        raise InputError(f"kappa varies on patch {number}: CalculiX takes a number, or six, for each solid")
    entries = kappa[:, 0].tolist()
    if len(entries) == 1:
        return ["*CONDUCTIVITY", _real(entries[0])]
    xx, xy, xz, yy, yz, zz = entries
    return ["*CONDUCTIVITY, TYPE=ANISO", ", ".join(map(_real, (xx, yy, zz, xy, xz, yz)))]


def _real(value: float) -> str:
    """Return a number with 13 digits, which take 20 characters at most."""
    return f"{value:.12e}"


def _rows(entries: Iterable[object], most: int = IN_A_ROW) -> Iterator[str]:
    """Yield entries in rows of at most so many, all but the last row with a comma behind."""
    words = list(map(str, entries))
    for begin in range(0, len(words), most):
        ends = begin + most >= len(words)
        yield ", ".join(words[begin : begin + most]) + ("" if ends else ",")
