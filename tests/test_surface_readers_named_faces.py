"""Faces of a solid model by name: what is a bore, a shaft, a fillet or a round, and which planes and radii are one."""

import math

import pytest

from parameterize.surface.readers.named_faces import described, named


def cylinder(radius=4.0, turn=2.0 * math.pi, hollow=True, centre=(0.0, 0.0, 0.0), axis=(0.0, 0.0, -1.0)):
    return {"kind": "cylinder", "radius": radius, "turn": turn, "hollow": hollow, "centre": centre, "axis": axis}


def names(*shapes):
    return {name: numbers for name, (numbers, _) in named(shapes, 100.0).items()}


@pytest.mark.parametrize(
    ("turn", "hollow", "name"),
    [(360, True, "bore 1"), (360, False, "shaft 1"), (90, True, "fillet 1"), (90, False, "round 1"), (180, True, None)],
)
def test_a_cylinder_is_named_by_its_turn_and_its_side(turn, hollow, name):
    """The end of a slot turns by 180 degrees: it has a radius, and no other name."""
    found = names(cylinder(turn=math.radians(turn), hollow=hollow))
    assert list(found) == ([name] if name else []) + ["radius 4"]


def test_two_halves_of_one_bore_are_one_and_bores_beside_it_are_others():
    half = math.pi
    found = names(
        cylinder(turn=half),
        cylinder(turn=half, centre=(0.0, 0.0, 7.0), axis=(0.0, 0.0, 1.0)),  # turned, and elsewhere on the axis
        cylinder(centre=(20.0, 0.0, 0.0)),
        cylinder(radius=5.0),
    )
    assert found == {"bore 1": [1, 2], "bore 2": [3], "bore 3": [4], "radius 4": [1, 2, 3], "radius 5": [4]}


def test_planes_across_an_axis_are_named_by_their_place():
    plane = {"kind": "plane", "centre": (3.0, 1e-9, 2.5), "normal": (0.0, -1.0, 0.0)}
    slanted = plane | {"normal": (0.0, 0.6, 0.8)}
    assert names(plane, plane, slanted) == {"plane y=0": [1, 2]}
    assert described(plane | {"centre": (3.0, 0.0, 2.5)}) == "plane through (3, 0, 2.5), normal (0, -1, 0)"


def test_shapes_are_told_in_words():
    torus = {"kind": "torus", "radius": 2.0, "ring": 9.0, "turn": 6.0, "hollow": True, "centre": (0, 0, 1)}
    assert described(torus | {"axis": (0.0, 0.0, -1.0)}) == (
        "torus of radius 2 around a circle of radius 9, axis (0, 0, 1) through (0, 0, 1)"
    )
    cone = {"kind": "cone", "angle": math.radians(30.0), "axis": (1.0, 0.0, 0.0), "centre": (0, 0, 0), "hollow": True}
    assert described(cone) == "cone of 30 degrees to its axis, axis (1, 0, 0) through (0, 0, 0)"
    sphere = {"kind": "sphere", "radius": 2.0, "centre": (1, 2, 3), "turn": 6.0, "hollow": False}
    assert described(sphere) == "sphere of radius 2 about (1, 2, 3)"
    assert described({"kind": "free"}) == "free surface"
