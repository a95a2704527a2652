"""Geometry files of GeoPDEs: patches, and their interfaces, which the control points show as the file lists them."""

import re

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from foreign_files import geopdes, geopdes_07, geopdes_patch
from foreign_models import patch_files
from glued import POINTS, demand_same

import iga_nn
from iga_nn.io.geopdes import read_geopdes
from parameterize.spline.interface import Interface
from parameterize.spline.volume import FACE_NAMES

TURNS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]
CORNER = row_of([(0, 0, 0), (1, 0, 0), (1, 1, 0)], TURNS)


def opened(text, in_folder):
    (in_folder / "geo.txt").write_text(text)
    return iga_nn.load_volume("geo.txt")


@pytest.mark.parametrize("body", [CORNER, ring(1), ring(3)], ids=["corner", "ring", "three"])
def test_patches_and_interfaces_are_read(body, in_folder):
    demand_same(opened(geopdes(body), in_folder), body)


def test_control_points_are_homogeneous(in_folder):
    """All weights are 2: the coordinates in the file are twice those of the control points."""
    demand_same(opened(geopdes(CORNER, scale=2.0), in_folder), CORNER)


def test_weights_are_read(in_folder):
    """Homogeneous coordinates are rounded, and so are those that are made of them."""
    body = exact_ring()
    again = opened(geopdes(body), in_folder)
    assert len(again.interfaces) == 4
    for one, other in zip(again, body, strict=True):
        assert np.array_equal(one.weights, other.weights)
        assert np.abs(one.control_points - other.control_points).max() < 1e-15


@pytest.mark.parametrize(
    "head",
    [
        "# nurbs mesh v.2.0\n",
        "####\n# HEADER\n# file: geo.txt\n# nurbs geometry v.2.1\n#\n",
        "#NURBS MESH V.2.1\n\n#\n",
    ],
)
def test_headers_of_the_new_versions(head, in_folder):
    demand_same(opened(geopdes(CORNER, head), in_folder), CORNER)


def test_a_file_of_version_07_has_no_dimension_of_space_and_no_names(in_folder):
    volume = CORNER.patches[1]
    again = opened(geopdes_07(volume), in_folder)
    assert isinstance(again, iga_nn.BSplineVolume) and np.array_equal(again(POINTS), volume(POINTS))
    text = geopdes(CORNER, "# nurbs mesh v.0.7\n").replace(" 3 3 3 2 1", "3 3 2 1")
    demand_same(opened(text, in_folder), CORNER)


def test_comments_may_stand_anywhere(in_folder):
    text = geopdes(CORNER).replace("\nPATCH", "\n# the next one\n\nPATCH").replace("\nINTERFACE", "\n#\nINTERFACE")
    demand_same(opened(text, in_folder), CORNER)


def test_one_patch_may_lack_all_counts_but_the_dimensions(in_folder):
    text = "# nurbs mesh v.2.1\n3 3\n" + "\n".join(geopdes_patch(CORNER.patches[0])) + "\n"
    assert isinstance(opened(text, in_folder), iga_nn.BSplineVolume)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("INTERFACE 1 \n1 ", "INTERFACE 1 \n0 ", "line .*: interface 1 names side . of patch 0: both count from 1"),
        ("INTERFACE 1 \n1 2", "INTERFACE 1 \n1 9", "line .*: interface 1 names side 9 of patch 1"),
        ("INTERFACE 1 \n1 2", "INTERFACE 1 \n9 2", "interface p.*p8_u1.*: there are 3 patches, counted from 0"),
        ("INTERFACE 1 \n1 2", "INTERFACE 1 \n1 1", "p0_u0 = p1_.*: the file says that they are one"),
        ("INTERFACE 1 \n1 2", "INTERFACE 1 \n1", "patch and side of interface 1 must be 2 numbers in one row, got 1"),
        (" 3 3 3 2 1", " 3 3 3 9 1", "ends before|must be"),
        (" 3 3 3 2 1", " 3 2 3 2 1", "maps 3 parameters to 2 coordinates"),
    ],
)
def test_faults_are_told_with_their_place(old, new, says, in_folder):
    text = geopdes(CORNER)
    assert old in text
    with pytest.raises(iga_nn.InputError, match=rf"geo\.txt: .*({says})"):
        opened(text.replace(old, new), in_folder)


def test_a_file_that_is_cut_off_is_refused_wherever_it_ends(in_folder):
    text = geopdes(CORNER)
    rows = text[: text.index("SUBDOMAIN")].splitlines()
    for count in range(4, len(rows)):
        with pytest.raises(iga_nn.InputError, match=r"geo\.txt: "):
            opened("\n".join(rows[:count]), in_folder)


def orientation_in(text, number):
    """The third row of an interface: whether axes are kept, and directions."""
    rows = text.splitlines()
    start = next(i for i, row in enumerate(rows) if row.strip() == f"INTERFACE {number}")
    pairs = [tuple(map(int, row.split())) for row in rows[start + 1 : start + 4]]
    first, second = ((patch - 1, FACE_NAMES[side - 1]) for patch, side in pairs[:2])
    swapped, *flipped = (flag < 0 for flag in pairs[2])
    if second < first:
        return Interface(second, first, swapped, tuple(reversed(flipped) if swapped else flipped))
    return Interface(first, second, swapped, tuple(flipped))


@pytest.mark.parametrize(
    ("name", "patches", "interfaces"),
    [("geo_2cubesa.txt", 2, 1), ("geo_2cubesd.txt", 2, 1), ("geo_4cubes.txt", 4, 4), ("geo_thickL_C0.txt", 1, 0)],
)
def test_models_of_geopdes_open_with_the_interfaces_and_orientations_that_they_list(name, patches, interfaces):
    for path in patch_files(name):
        text = path.read_text()
        body = iga_nn.Body.from_patches(read_geopdes(text)[0])
        assert (len(body), len(body.interfaces)) == (patches, interfaces)
        assert set(body.interfaces) == {orientation_in(text, number + 1) for number in range(interfaces)}
        assert isinstance(iga_nn.load_volume(path), iga_nn.BSplineVolume if patches == 1 else iga_nn.Body)


CUBE = ("0 1 0 1 0 1 0 1", "0 0 1 1 0 0 1 1", "0 0 0 0 1 1 1 1", "1 1 1 1 1 1 1 1")


def cube(head="# nurbs mesh v.2.1\n3 3 1 0 0\nPATCH 1\n", knots="0 0 1 1", rows=CUBE, end=""):
    """The unit cube in one patch of degree 1."""
    return head + "\n".join(["1 1 1", "2 2 2", *[knots] * 3, *rows, end])


@pytest.mark.parametrize("head", ["# nurbs geometry v.1.0\n3 3 1 0 0\nP\n", "# nurbs geometry v.0.6\n3 1\n"])
def test_the_numbers_of_a_file_depend_on_its_version(head, in_folder):
    """Since v.1.0 the dimension of space stands before the number of patches."""
    assert np.abs(opened(cube(head), in_folder)(POINTS) - POINTS).max() < 1e-15


@pytest.mark.parametrize(
    "text",
    [
        cube(knots="0, 0, 1, 1"),
        cube(knots="[0 0 1 1];"),
        cube(knots="0/3 0/3 3/3 6/6"),
        cube(rows=(*CUBE[:3], "1D+0 1d0 1D0 1.0D+00 10d-1 1e0 +1 1.")),
        cube().replace("PATCH 1", "2nd patch, turned"),
        cube().replace("PATCH 1", "12 holes"),
        cube().replace("\n", "\r\n"),
    ],
    ids=["commas", "brackets", "fractions", "exponents", "name", "name with a number", "line ends"],
)
def test_rows_as_matlab_reads_them(text, in_folder):
    assert np.abs(opened(text, in_folder)(POINTS) - POINTS).max() < 1e-15


@pytest.mark.parametrize("word", ["1_0", "1D", "1/2/3", "sqrt(2)", "1+1"])
def test_words_that_are_no_numbers_are_refused(word, in_folder):
    with pytest.raises(
        iga_nn.InputError, match=rf"geo\.txt: line 9: the x .* must be numbers, got '{re.escape(word)}'"
    ):
        opened(cube(rows=(CUBE[0].replace("1", word, 1), *CUBE[1:])), in_folder)


def test_subdomains_and_boundaries_are_told(in_folder, caplog):
    head = "# nurbs mesh v.2.1\n3 3 1 0 2\nPATCH 1\n"
    opened(cube(head, end="SUBDOMAIN 1\n1\nSUBDOMAIN 2\n1\nBoundary walls\n1\n1 2\n"), in_folder)
    assert "its 2 subdomains are not read" in caplog.text and "p0_u0 (Boundary walls)" in caplog.text


def test_one_subdomain_says_nothing(in_folder, caplog):
    opened(cube("# nurbs mesh v.2.1\n3 3 1 0 1\nPATCH 1\n", end="SUBDOMAIN 1\n1\n"), in_folder)
    assert not caplog.text
