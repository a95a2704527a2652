"""Defines Region: a part of the solid's boundary, named by a condition on position and outward normal."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import FACE_NAMES

from .frame import UnitFrame
from .jets import Jet, coordinates
from .parser import SCALED, VARIABLES, Decider, ExpressionError, Translator, scaled

NORMAL = ("nx", "ny", "nz")
CALL = re.compile(r"\b(face|box)\s*\(([^()]*)\)")
PATCH_FACE = re.compile(r"\bp\d+_[uvw][01]\b")
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
NAMED = re.compile(  # of a solid model: a face, or what its reader calls some of them
    rf"\b(?:(?P<kind>bore|shaft|fillet|round)\s+(?P<number>\d+)|face(?P<face>\d+)"
    rf"|radius\s+(?P<radius>{NUMBER})|plane\s+(?P<axis>[xyz])\s*=\s*(?P<place>{NUMBER}))(?![\w.])"
)
NEARLY_NAMED = re.compile(r"\b(?:bore|shaft|fillet|round|radius|plane)\b")
NAMED_FORMS = "'bore 2', 'shaft 1', 'fillet 1', 'round 1', 'radius 8', 'plane z=0' or 'face4'"
GROUP = re.compile(r"""group:("[^"]*"|'[^']*'|[^\s()]+)""")
ANGLE = 30.0  # degrees between neighbouring triangles beyond which an edge is sharp
# The tolerance of positions, of the diagonal of the points' box, and of the components of normals: rounding is some
# 1e-15, and a spline is seldom closer to its part than 1e-6. Far from the origin rounding is that of the coordinates:
# the diagonal counts as no less than FAR of the largest.
TOLERANCE, FAR = 1e-9, 4e-3

Mask = NDArray[np.bool_]


@runtime_checkable
class Part(Protocol):
    """Describe the surface mesh of a part, as regions need it."""

    @property
    def normals(self) -> Array:
        """Return the outward unit normals (m, 3) of the triangles."""

    def group(self, name: str) -> IntArray:
        """Return the triangles (k,) of a group of the mesh. Raises ValueError for a name of no group."""

    def nearest(self, points: Array, normals: Array | None = None) -> IntArray:
        """Return the triangle (m,) nearest to each point (m, 3).

        Of triangles at the same distance, the one whose normal is closest to the given normal is chosen.
        """

    def flood(self, triangle: int, angle: float) -> IntArray:
        """Return the triangles (k,) reached from a triangle across edges that bend by less than an angle in degrees."""


@dataclass(frozen=True, eq=False)
class FacesOfPoints:
    """Say on which faces points (3, ...) lie.

    names: of the faces, such as "u0", or "p2_u0" of patch 2 of several. of: (...), the number of the face of each
    point. near: a number or (...), the tolerance of positions.
    """

    names: Sequence[str]
    of: IntArray
    near: float | Array

    def named(self, name: str) -> Mask:
        """Return the mask (...) of the points on faces of a name: "u0" of all patches, "p2_u0" of one."""
        is_one = "_" in name
        alike = [own == name if is_one else own.endswith(name) for own in self.names]
        return np.asarray(np.array(alike)[self.of])

    def nearest(self, surface: Part, x: Array, normal: Array) -> IntArray:
        """Return the triangle (...) of a surface nearest to each point; it is found once for all regions."""
        if id(surface) not in self._nearest:
            found = surface.nearest(x.reshape(3, -1).T, normal.reshape(3, -1).T)
            self._nearest[id(surface)] = found.reshape(x.shape[1:])
        return self._nearest[id(surface)]

    @cached_property
    def _nearest(self) -> dict[int, IntArray]:
        return {}


@dataclass(frozen=True)
class Region:
    """A part of the solid's boundary: where a condition on the position and the outward normal holds.

    The last bits of a point do not decide to which region it belongs: `<=`, `>=` and `box` hold up to 1e-9 of the
    diagonal of the points beyond their bound, `<` and `>` from 1e-12 of it on.

    Parameters
    ----------
    text : str
        A condition in x, y, z or X, Y, Z (scaled to volume 1 about the middle) and in the outward unit normal nx, ny,
        nz, such as "nz > 0.99 and abs(x) < 2": comparisons, and, or, not, and the functions of formulas. Also
        conditions: u0, u1, v0, v1, w0, w1, the images of the cube's faces, and p2_u0 that of patch 2 of several;
        box(x0, y0, z0, x1, y1, z1);
        group:NAME, a group of the input mesh, of a solid model also without `group:` by its names, face4, bore 2,
        shaft 1, fillet 1, round 3, radius 8, plane z=0; and face(x, y, z), the part of the surface around the place
        nearest to that point, up to edges that bend by more than 30 degrees, or by a fourth number in degrees.
    surface : Part, optional
        The part's surface mesh (`result.boundary.part`), which group:NAME and face(x, y, z) need. Where it is known,
        normals are those of its triangles: a spline rounds the edges off, and there its own normals turn.

    Raises
    ------
    ExpressionError
        For a text that is refused.
    TypeError
        For a surface that is no surface mesh.

    Examples
    --------
    >>> import iga_nn
    >>> top = iga_nn.Region("nz > 0.9") - iga_nn.Region("box(0, 0, 0, 1, 1, 2)")
    >>> print(top)
    (nz > 0.9) and not (box(0, 0, 0, 1, 1, 2))
    """

    text: str
    surface: Part | None = field(default=None, repr=False, compare=False)
    frame: UnitFrame | None = field(default=None, repr=False, compare=False)
    _marks: tuple[str, ...] = field(init=False, repr=False, compare=False)
    _used: frozenset[str] = field(init=False, repr=False, compare=False)
    _decide: Decider = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise ExpressionError(f"a region must be text, such as 'z < 1', got {type(self.text).__name__}")
        if self.surface is not None and not isinstance(self.surface, Part):
            raise TypeError(
                f"a region's surface must be a part's surface mesh, result.boundary.part, got {self.surface!r:.80}"
            )
        marks: list[str] = list(FACE_NAMES)

        def mark(kind: str, argument: str) -> str:
            marks.append(f"{kind} {argument}")
            return f" _mark{len(marks) - 1} "

        text = GROUP.sub(lambda found: mark("group", found[1].strip("'\"")), self.text)
        text = NAMED.sub(lambda found: mark("group", _name(found)), text)
        text = CALL.sub(lambda found: mark(found[1], found[2]), text)
        text = PATCH_FACE.sub(lambda found: mark("patch", found[0]), text)
        names = [f"_mark{i}" if i >= len(FACE_NAMES) else name for i, name in enumerate(marks)]
        try:
            translator = Translator(text, (*VARIABLES, *NORMAL), names, _change)
            decide = translator.condition()
            for entry in marks[len(FACE_NAMES) :]:
                _check_mark(entry)
        except ExpressionError as error:
            if NEARLY_NAMED.search(text):
                raise ExpressionError(f"region {self.text!r:.80}: faces of a solid model are {NAMED_FORMS}") from None
            raise ExpressionError(f"region {self.text!r:.80}: {_readable(str(error), marks)}") from None
        for name, value in (("_marks", tuple(marks)), ("_used", frozenset(translator.used)), ("_decide", decide)):
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the text for a pickle; the copy parses it again."""
        return Region, (self.text, self.surface, self.frame)

    def __str__(self) -> str:
        return self.text

    def __or__(self, other: Region) -> Region:
        return self._with(f"({self}) or ({other})", other)

    def __and__(self, other: Region) -> Region:
        return self._with(f"({self}) and ({other})", other)

    def __sub__(self, other: Region) -> Region:
        return self._with(f"({self}) and not ({other})", other)

    def __invert__(self) -> Region:
        return self._with(f"not ({self})", self)

    def _with(self, text: str, other: Region) -> Region:
        return Region(text, self.surface or other.surface, self.frame or other.frame)

    @property
    def is_scaled(self) -> bool:
        """Return whether X, Y or Z occurs in the condition."""
        return not self._used.isdisjoint(SCALED)

    @cached_property
    def faces(self) -> tuple[str, ...]:
        """Return the names of the cube's faces that make up the region; empty where the text contains anything else."""
        words = re.split(r"\s+or\s+", self.text.strip())
        return tuple(words) if all(word in FACE_NAMES or PATCH_FACE.fullmatch(word) for word in words) else ()

    @property
    def patch_faces(self) -> tuple[str, ...]:
        """Return the faces of single patches of several that occur in the condition, as "p2_u0"."""
        return tuple(entry.removeprefix("patch ") for entry in self._marks if entry.startswith("patch "))

    def placed(self, frame: UnitFrame | None = None, surface: Part | None = None) -> Region:
        """Return the same region with X, Y, Z measured in a frame, and with a surface where it has none."""
        return replace(self, frame=frame or self.frame, surface=self.surface or surface)

    @property
    def needs_cube(self) -> bool:
        """Return whether a face of the cube occurs in the condition."""
        return not self._used.isdisjoint(FACE_NAMES)

    @property
    def needs_surface(self) -> bool:
        """Return whether a group or a face of the part occurs in the condition."""
        return bool(self._of_part)

    @property
    def needs_normal(self) -> bool:
        """Return whether the condition depends on normals: by nx, ny, nz, or by a group or a face of the part."""
        return not self._used.isdisjoint((*NORMAL, *self._of_part))

    @property
    def _of_part(self) -> list[str]:
        """Return the marks that are groups or faces of the part."""
        return [f"_mark{i}" for i, entry in enumerate(self._marks) if entry.startswith(("group ", "face "))]

    def holds(self, x: Array, normal: Array, face: str = "") -> Mask:
        """Return the mask (...) of the points (3, ...) with outward unit normals (3, ...) where the condition holds.

        face: the cube's face on whose image the points lie, if any: "u0", or "p2_u0" of patch 2 of several. Raises
        ExpressionError where X, Y, Z occur without a frame, ValueError where the surface lacks a face or group.
        """
        return self.holds_on(np.asarray(x), np.asarray(normal), FacesOfPoints((face,), np.array(0), tolerance(x)))

    def holds_on(self, x: Array, normal: Array, on: FacesOfPoints) -> Mask:
        """Return the mask of `holds` for points (3, ...) on several faces."""
        jets = _moved(x, on.near)
        if self.is_scaled and self.frame is None:
            raise ExpressionError(f"region {self.text!r:.80}: X, Y, Z mean nothing without a volume")
        of_frame = scaled(self.frame, jets) if self.frame is not None and self.is_scaled else jets
        nearest = None
        if self.surface is not None and self.needs_normal:
            nearest = on.nearest(self.surface, x, normal)
            normal = np.moveaxis(self.surface.normals[nearest], -1, 0)
        values: list[Any] = [*jets, *of_frame, *_moved(normal, TOLERANCE)]
        values += [on.named(name) if name in self._used else False for name in FACE_NAMES]
        values += [self._marked(entry, x, nearest, on) for entry in self._marks[len(FACE_NAMES) :]]
        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(self._decide(values), dtype=bool), x.shape[1:])

    def _marked(self, entry: str, x: Array, nearest: IntArray | None, on: FacesOfPoints) -> Mask:
        """Return the mask (...) of the points that lie on a patch's face, in a box, or in a group or face of the part.

        nearest: (...), the nearest triangle of the part for each point.
        """
        kind, argument = entry.split(" ", 1)
        if kind == "patch":
            return on.named(argument)
        if kind == "box":
            low, high = np.sort(np.reshape(_numbers(argument), (2, 3)), axis=0)
            sides = (slice(None), *[None] * (x.ndim - 1))
            inside: Mask = np.all((x >= low[sides] - on.near) & (x <= high[sides] + on.near), axis=0)
            return inside
        if nearest is None:
            raise ValueError(
                f"region {self.text!r:.80}: {kind} needs the part's surface, result.boundary.part, as the second "
                "argument of Region"
            )
        return np.isin(nearest, self._members(kind, argument))

    def _members(self, kind: str, argument: str) -> IntArray:
        """Return the triangles (k,) of a group or a face of the part."""
        assert self.surface is not None
        if kind == "group":
            return self.surface.group(argument)
        numbers = _numbers(argument)
        start = int(self.surface.nearest(np.reshape(numbers[:3], (1, 3)))[0])
        return self.surface.flood(start, numbers[3] if len(numbers) == 4 else ANGLE)


Regions = Region | str | Sequence[Region | str]


def regions_of(given: Regions) -> list[Region]:
    """Return a region, a text, or several of these as regions. Raises ExpressionError for anything else."""
    if isinstance(given, Region):
        return [given]
    if isinstance(given, str) or not isinstance(given, Sequence):
        return [Region(given)]
    return [region for entry in given for region in regions_of(entry)]


def tolerance(x: Array) -> float:
    """Return the tolerance of the positions of points (3, ...), a length; 0 where one of them is not finite."""
    points = np.reshape(x, (3, -1)).T
    return float(tolerances(points[None])[0]) if points.size else 0.0


def tolerances(points: Array) -> Array:
    """Return the tolerances (k,) of positions near each of several sets of points (k, n, 3)."""
    sizes = np.linalg.norm(np.ptp(points, axis=1), axis=1)
    found = TOLERANCE * np.maximum(sizes, FAR * np.abs(points).max(axis=(1, 2)))
    return np.where(np.isfinite(found), found, 0.0)


def _moved(rows: Array, step: float | Array) -> list[Jet]:
    """Return the jets of three coordinates (3, ...) whose gradient is the change along a step in each direction."""
    steps = [tuple(step if slope else 0.0 for slope in jet.gradient) for jet in coordinates(rows)]
    return [replace(jet, gradient=row) for jet, row in zip(coordinates(rows), steps, strict=True)]


def _change(a: Jet, b: Jet) -> Any:
    """Return by how much a difference of two numbers changes where a point moves by the tolerance."""
    slopes = [np.abs(slope) for slope in (a - b).gradient]
    return np.nan_to_num(sum(slopes), nan=0.0, posinf=0.0)  # of a root at zero the slope is no number


def _name(found: re.Match[str]) -> str:
    """Return the group of a face that a text names: "bore 2", "face4", "radius 8", "plane z=0"."""
    if found["kind"]:
        return f"{found['kind']} {int(found['number'])}"
    if found["face"]:
        return f"face{int(found['face'])}"
    if found["radius"]:
        return f"radius {float(found['radius']):.6g}"
    return f"plane {found['axis']}={float(found['place']) + 0.0:.6g}"


def _numbers(argument: str) -> list[float]:
    return [float(ast.literal_eval(part.strip())) for part in argument.split(",")]


def _check_mark(entry: str) -> None:
    """Raise ExpressionError for a box or a face without its numbers."""
    kind, argument = entry.split(" ", 1)
    if kind in ("group", "patch"):
        return
    counts = {"box": ((6,), "box(x0, y0, z0, x1, y1, z1)"), "face": ((3, 4), "face(x, y, z)")}[kind]
    try:
        numbers = _numbers(argument)
        good = len(numbers) in counts[0] and bool(np.all(np.isfinite(numbers)))
        good = good and (len(numbers) != 4 or 0.0 <= numbers[3] <= 180.0)
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
        good = False
    if not good:
        raise ExpressionError(f"{kind}({argument:.40}): write {counts[1]}, with numbers; an angle is from 0 to 180")


def _readable(message: str, marks: Sequence[str]) -> str:
    """Return a message with the user's text in place of the marks."""
    for i in range(len(marks) - 1, len(FACE_NAMES) - 1, -1):
        kind, argument = marks[i].split(" ", 1)
        shown = {"group": f"group:{argument}", "patch": argument}.get(kind, f"{kind}({argument})")
        message = message.replace(f", _mark{i}", "").replace(f"_mark{i}", shown)
    return message
