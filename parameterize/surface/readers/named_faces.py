"""Names the faces of a solid model by their shapes: bores, shafts, fillets and rounds, radii, planes across an axis.

The names are groups, beside face1, face2, ...: "bore 2", "fillet 1", "radius 8", "plane z=0". A region may say them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...arrays import Array, in_brackets

AXES = ("x", "y", "z")
EQUAL = 1e-6  # of the part's size: radii, axes and planes that differ by less are the same
STRAIGHT = 1e-7  # of a unit vector's components
FULL = 2.0 * math.pi - 1e-3  # radians: a cylinder that turns so far is a bore or a shaft
PARTIAL = math.radians(170.0)  # a round face that turns less is a fillet or a round: the end of a slot turns by 180

Shape = Mapping[str, Any]  # of one face, as `shape_of` of `opencascade.py` gives it


def described(shape: Shape) -> str:
    """Return the shape of a face in words, such as "cylinder of radius 4, axis (0, 0, 1) through (45, 30, 0)"."""
    kind = shape["kind"]
    if kind == "plane":
        return f"plane through {_place(shape['centre'])}, normal {_direction(shape['normal'])}"
    if kind == "free":
        return "free surface"
    if kind == "sphere":
        return f"sphere of radius {shape['radius']:.6g} about {_place(shape['centre'])}"
    size = {
        "cylinder": lambda: f"of radius {shape['radius']:.6g}",
        "torus": lambda: f"of radius {shape['radius']:.6g} around a circle of radius {shape['ring']:.6g}",
        "cone": lambda: f"of {math.degrees(shape['angle']):.4g} degrees to its axis",
    }[kind]()
    return f"{kind} {size}, axis {_direction(_forward(shape['axis']))} through {_place(shape['centre'])}"


def named(shapes: Sequence[Shape], size: float) -> dict[str, tuple[list[int], str]]:
    """Return the names of faces with the numbers of their faces, counted from 1, and their shape in words.

    size: of the part, by which shapes are told apart.
    """
    close = EQUAL * size
    found: dict[str, tuple[list[int], str]] = {}
    counts: dict[str, int] = {}
    for numbers in _alike(shapes, close):
        name = _name([shapes[number - 1] for number in numbers])
        if name:
            counts[name] = counts.get(name, 0) + 1
            found[f"{name} {counts[name]}"] = numbers, described(shapes[numbers[0] - 1])
    for number, shape in enumerate(shapes, start=1):
        for name in _values(shape, close):
            found.setdefault(name, ([], ""))[0].append(number)
    return found


def _alike(shapes: Sequence[Shape], close: float) -> Iterator[list[int]]:
    """Yield the numbers of round faces that lie on one surface, from the same side."""
    every: list[list[int]] = []
    of_size: dict[Any, list[list[int]]] = {}
    for number, shape in enumerate(shapes, start=1):
        if "radius" not in shape:
            continue
        groups = of_size.setdefault((shape["kind"], shape["hollow"], f"{shape['radius']:.6g}"), [])
        own = next((group for group in groups if _is_same(shapes[group[0] - 1], shape, close)), None)
        if own is None:
            own = []
            groups.append(own)
            every.append(own)
        own.append(number)
    yield from every


def _is_same(one: Shape, other: Shape, close: float) -> bool:
    """Return whether two round faces of one kind and radius lie on one surface."""
    if abs(one.get("ring", 0.0) - other.get("ring", 0.0)) > close:
        return False
    apart = np.subtract(other["centre"], one["centre"])
    if "axis" in one:
        if abs(float(np.dot(one["axis"], other["axis"]))) < 1.0 - STRAIGHT:
            return False
        if one["kind"] == "cylinder":
            apart = apart - np.dot(apart, one["axis"]) * np.array(one["axis"])
    return bool(np.linalg.norm(apart) <= close)


def _name(shapes: Sequence[Shape]) -> str:
    """Return what faces of one round surface are; "" for nothing that has a name."""
    turn, hollow = sum(shape["turn"] for shape in shapes), shapes[0]["hollow"]
    if shapes[0]["kind"] == "cylinder" and turn >= FULL:
        return "bore" if hollow else "shaft"
    if shapes[0]["kind"] == "torus" or max(shape["turn"] for shape in shapes) < PARTIAL:
        return "fillet" if hollow else "round"
    return ""


def _values(shape: Shape, close: float) -> Iterator[str]:
    """Yield the names of a face that say a number: its radius, or where a plane cuts an axis."""
    if "radius" in shape:
        yield f"radius {shape['radius']:.6g}"
    if shape["kind"] == "plane":
        axis = int(np.argmax(np.abs(shape["normal"])))
        if abs(shape["normal"][axis]) >= 1.0 - STRAIGHT:
            value = shape["centre"][axis]
            yield f"plane {AXES[axis]}={0.0 if abs(value) <= close else value:.6g}"


def _forward(axis: Sequence[float]) -> Array:
    """Return an axis (3,) that points where its largest component is positive."""
    return np.asarray(axis) * (1.0 if axis[int(np.argmax(np.abs(axis)))] >= 0.0 else -1.0)


def _direction(vector: Any) -> str:
    return _place(np.where(np.abs(vector) < STRAIGHT, 0.0, vector))


def _place(point: Any) -> str:
    """Return a point (3,) in brackets; what is rounding beside its largest coordinate is 0."""
    row = np.asarray(point, dtype=float)
    return in_brackets(np.where(np.abs(row) <= 1e-9 * max(1.0, float(np.abs(row).max())), 0.0, row))
