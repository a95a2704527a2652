"""Regions: where conditions on position and normal hold, and which texts are refused."""

import pickle

import numpy as np
import pytest

import iga_nn
from solve.forms.frame import UnitFrame
from solve.forms.parser import Expression, ExpressionError
from solve.forms.region import Region, regions_of

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [-1.0, 5.0, 0.5]]).T
UP = np.array([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.0, 0.0, -1.0]]).T


def holds(text, face="", **known):
    return Region(text, **known).holds(POINTS, UP, face).tolist()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("z < 1", [True, False, True]),
        ("z < 1 and nz > 0", [True, False, False]),
        ("not z < 1", [False, True, False]),
        ("0 < x <= 1", [False, True, False]),
        ("x < 0 or ny > 0.7", [False, True, True]),
        ("max(abs(x), 2) >= y", [True, True, False]),
        ("where(nz > 0.5, 1, x) > 0", [True, True, False]),
        ("box(-1, 0, 0, 1, 5, 1)", [True, False, True]),
        ("box(1, 5, 1, -1, 0, 0)", [True, False, True]),
        ("u0", [False, False, False]),
        ("v1 and z < 1", [True, False, True]),
        ("x*x + y*y + z*z < 14.5", [True, True, False]),
    ],
)
def test_a_region_holds_where_its_condition_says(text, expected):
    assert holds(text, "v1") == expected


@pytest.mark.parametrize("moved", [-4e-15, -4e-16, 0.0, 4e-16, 4e-15])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_last_bits_of_a_point_decide_nothing(size, moved):
    x = size * np.array([[0.0, 0.5, 1.0], [0.2, 0.2, 0.9], [1.0 + moved, 0.5, -moved]])
    normal = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 0.0], [1.0 - abs(moved), 0.8, 0.6]])

    def at(text):
        return Region(text.replace("S", repr(size))).holds(x, normal).tolist()

    assert at("box(0, 0, 0, S, S, S)") == [True, True, True]
    assert at("z <= S") == at("z >= 0") == [True, True, True]
    assert at("z < S") == [False, True, True] and at("z > 0") == [True, True, False]
    assert at("not z < S") == at("z >= S") == [True, False, False]
    assert at("x*x + z*z <= S*S") == at("sqrt(x**2 + z**2) <= S") == [True, True, True]
    assert at("nz >= 1") == [True, False, False] and at("nz >= 0.8") == [True, True, False]
    assert at("0 <= z <= S") == [True, True, True] and at("0 < z < S") == [False, True, False]
    assert at("z < 1e-9*S") == [False, False, True]
    assert at("max(x, z) >= S") == [True, False, True] and at("sqrt(x) >= 0") == [True, True, True]


def test_far_from_the_origin_rounding_is_that_of_the_coordinates():
    x = 1e7 + np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 1.0 + 2e-9]])
    assert Region("z <= 10000001").holds(x, np.ones((3, 2))).all()
    assert not Region("z > 10000001").holds(x, np.ones((3, 2))).any()


def test_unions_differences_and_complements_are_regions_again():
    low, left = Region("z < 1"), Region("x < 0")
    for region, expected in ((low | left, "101"), (low & left, "001"), (low - left, "100"), (~low, "010")):
        assert region.holds(POINTS, UP).tolist() == [digit == "1" for digit in expected]
    assert str(low - left) == "(z < 1) and not (x < 0)"
    assert pickle.loads(pickle.dumps(low)).holds(POINTS, UP).tolist() == [True, False, True]
    assert [str(region) for region in regions_of(["z < 1", low])] == ["z < 1", "z < 1"]


def test_scaled_coordinates_need_a_frame():
    frame = UnitFrame((1.0, 2.0, 3.0), 2.0)
    assert holds("X > -0.6", frame=frame) == [True, True, False]
    with pytest.raises(ExpressionError, match="X, Y, Z mean nothing without a volume"):
        holds("X > 0")


def test_faces_alone_are_known_as_faces():
    assert Region("u0").faces == ("u0",)
    assert Region("u0 or w1").faces == ("u0", "w1")
    assert Region("u0 and z < 1").faces == ()
    assert Region("z < 1").faces == ()
    assert Region("u0 and z < 1").needs_cube and not Region("z < 1").needs_cube


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the expression is empty"),
        ("x", "is a number, where a condition must stand"),
        ("x < 1 and y", "is a number, where a condition must stand"),
        ("x == 1", "conditions compare with <, <=, > and >="),
        ("q < 1", "unknown name"),
        ("u0 < 1", "is a condition, where a number must stand"),
        ("x < (y < 1)", "is a condition, where a number must stand"),
        ("box(1, 2)", r"write box\(x0, y0, z0, x1, y1, z1\)"),
        ("plane q=0", "faces of a solid model are 'bore 2'"),
        ("bore", "faces of a solid model are 'bore 2'"),
        ("face(1, 2)", r"write face\(x, y, z\)"),
        ("face(a, b, c)", r"write face\(x, y, z\)"),
        ("face(1, 2, 3, -5)", "an angle is from 0 to 180"),
        ("__import__('os') < 1", "not a known function"),
        (3.0, "must be text"),
    ],
)
def test_other_texts_are_refused_in_one_line(text, says):
    with pytest.raises(ExpressionError, match=says) as caught:
        Region(text)
    assert "\n" not in str(caught.value) and "_mark" not in str(caught.value)


def test_a_group_or_a_face_needs_the_surface_of_the_part():
    for text in ("group:inlet", "face(0, 0, 1)"):
        with pytest.raises(ValueError, match="needs the part's surface"):
            holds(text)


def test_a_face_of_the_part_ends_at_sharp_edges_and_groups_are_named():
    part = iga_nn.sample("cube").part  # of side 1
    on_top = np.array([[0.3, 0.4, 1.0], [0.5, 0.5, 0.0], [1.0, 0.5, 0.999]]).T
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]).T
    assert Region("face(0.9, 0.9, 1)", part).holds(on_top, normals).tolist() == [True, False, False]
    assert Region("face(0.9, 0.9, 1, 95)", part).holds(on_top, normals).all()
    with pytest.raises(ValueError, match="group 'inlet' does not exist"):
        Region("group:inlet", part).holds(on_top, normals)


def test_normals_are_those_of_the_part_where_it_is_known():
    part = iga_nn.sample("cube").part
    rounded = np.array([[0.5, 0.99, 1.0]]).T
    turned = np.array([[0.0, 0.6, 0.8]]).T  # as of a spline that rounds the edge off
    assert not Region("nz > 0.99").holds(rounded, turned).any()
    assert Region("nz > 0.99", part).holds(rounded, turned).all()


def test_formulas_choose_but_are_then_not_smooth():
    formula = Expression("where(x < 1, min(x, 0.5), max(y, 2))")
    assert formula([0.2, 0.9, 3.0], 1.0, 0.0).tolist() == [0.2, 0.5, 2.0]
    assert not formula.is_smooth and Expression("x").is_smooth
    with pytest.raises(ValueError, match="choice"):
        iga_nn.Poisson(exact="min(x, y)")
    iga_nn.Poisson(source="where(x < 1, 1, 0)")
    with pytest.raises(ExpressionError, match=r"write where\(condition, a, b\)"):
        Expression("x < 1")


@pytest.mark.parametrize(
    ("text", "mark"),
    [
        ("bore 2", "group bore 2"),
        ("face12 and z > 1", "group face12"),
        ("radius 8.50", "group radius 8.5"),
        ("plane z = -0.0", "group plane z=0"),
        ("not fillet  3", "group fillet 3"),
    ],
)
def test_names_of_a_solid_model_are_groups(text, mark):
    region = Region(text)
    assert region._marks[-1] == mark and region.needs_surface


@pytest.mark.parametrize("text", ["bore", "bore 2.5", "plane q=1", "radius", "facet3"])
def test_what_is_no_name_of_a_face_is_refused(text):
    with pytest.raises(ExpressionError):
        Region(text)
