"""Reads geometry files of GeoPDEs, "nurbs mesh v.0.7" to "v.2.1", with one patch or several.

After rows of comments stand the numbers of parameters, coordinates (since v.1.0), patches, interfaces and subdomains.
A patch has its name, degrees, numbers of control points, knot vectors, a row for each homogeneous coordinate of the
control points, u fastest, and a row of weights. An interface has its name, patch and side of either face, and the way
they lie on each other, which the control points tell, too. Patches count from 1, sides from 1: u0, u1, v0, v1, w0, w1.
Subdomains and boundaries, at the end, are not read. GeoPDEs reads rows as MATLAB does, so numbers may stand between
brackets, with commas, as fractions, and with exponents by D. Sources: geo_specs_v06.txt to geo_specs_mp_v21.txt,
geo_specs_mp_v10.txt and `geo_read_nurbs` of GeoPDEs.
"""

import logging

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.interface import Face
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume

from .beginnings import GEOPDES
from .patches_of_files import patch_of, projected
from .words import Words, faults_of, is_number

log = logging.getLogger(__name__)

HEAD = 4096  # characters in which it stands
SHOWN = 6  # names in a notice
PUNCTUATION = str.maketrans(",;[]", "    ")  # between the numbers of a row of MATLAB


def read_geopdes(text: str) -> tuple[list[BSplineVolume], list[tuple[Face, Face]]]:
    """Return the patches, and the pairs of faces that the file declares glued. Raises ValueError with the line."""
    words = Words(text.translate(PUNCTUATION))
    header = GEOPDES.search(text, 0, HEAD)
    old = header is not None and int(header[1]) < 1
    what = "the numbers of dimensions and patches"
    dimension, *rest = words.as_wholes(words.row(what), what)
    space = dimension if old or not rest else rest.pop(0)
    if (dimension, space) != (3, 3):
        raise words.fault(f"maps {dimension} parameters to {space} coordinates; a volume maps 3 to 3")
    patches, interfaces, *others = [*rest, *(1, 0)[len(rest) :]]
    if not patches:
        raise words.fault("holds no patch")
    content = (
        [_read_patch(words, f"patch {number + 1}") for number in range(patches)],
        [_read_interface(words, f"interface {number + 1}") for number in range(interfaces)],
    )
    if max(others, default=0) > 1:
        log.warning("its %d subdomains are not read: name their patches, as in young={0: .., 1: ..}", max(others))
    if boundaries := [name for name in _names_left(words) if "boundary" in name.lower()]:
        log.warning("its boundaries are not read: name faces such as p0_u0 (%s)", ", ".join(boundaries[:SHOWN]))
    return content


def _names_left(words: Words) -> list[str]:
    """Return the rows to the end of the file that are no numbers."""
    rows = []
    while words.peek() is not None:
        rows.append(words.row("a name"))
    return [" ".join(row) for row in rows if not all(map(is_number, row))]


def _read_patch(words: Words, name: str) -> BSplineVolume:
    """Return the next patch. name: for errors."""
    row = words.row(f"the name or the degrees of {name}")
    if not all(map(is_number, row)):  # it is the name, such as "2nd patch"
        row = words.row(f"the degrees of {name}")
    degrees = words.as_wholes(_demand(words, row, 3, f"the degrees of {name}"), f"the degrees of {name}")
    counts = _wholes(words, 3, f"the numbers of control points of {name}")
    knots = [
        _reals(words, count + degree + 1, f"the knots of {name} in {axis}")
        for count, degree, axis in zip(counts, degrees, AXES, strict=True)
    ]
    total = int(np.prod(counts, dtype=object))
    points = np.stack([_reals(words, total, f"the {axis} coordinates of {name}") for axis in "xyz"], axis=1)
    weights = _reals(words, total, f"the weights of {name}")
    with faults_of(name):
        return patch_of(degrees, knots, projected(points, weights), weights)


def _read_interface(words: Words, name: str) -> tuple[Face, Face]:
    words.row(f"the name of {name}")
    first, second = (_face(words, name) for _ in range(2))
    words.row(f"the orientation of {name}")
    return first, second


def _face(words: Words, name: str) -> Face:
    patch, side = _wholes(words, 2, f"patch and side of {name}")
    if patch < 1 or not 1 <= side <= len(FACE_NAMES):
        raise words.fault(f"{name} names side {side} of patch {patch}: both count from 1, sides to {len(FACE_NAMES)}")
    return patch - 1, FACE_NAMES[side - 1]


def _wholes(words: Words, count: int, what: str) -> list[int]:
    return words.as_wholes(_row(words, count, what), what)


def _reals(words: Words, count: int, what: str) -> Array:
    return words.as_reals(_row(words, count, what), what)


def _row(words: Words, count: int, what: str) -> list[str]:
    """Return the next row, which must have `count` words."""
    return _demand(words, words.row(what), count, what)


def _demand(words: Words, row: list[str], count: int, what: str) -> list[str]:
    if len(row) != count:
        raise words.fault(f"{what} must be {count} numbers in one row, got {len(row)}")
    return row
