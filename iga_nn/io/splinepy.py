"""Reads and writes splinepy's JSON, and converts volumes, bodies and solutions to splines of splinepy and back.

The JSON is a list of splines, here a `BSpline` a patch: degrees, knot vectors, control points with every digit of a
double, u fastest (volume.npz: w fastest). A solution u_h(u, v, w) has a file of its own, on its own degrees and knots:
a spline of one coordinate, or of three for displacements (`dim`).
"""

import json
import logging
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.interface import Face, Interface
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve.field import FieldOnBody, SplineField

from ..errors import InputError, one_line
from .patches_of_files import fastest_first, patch_of
from .words import faults_of

INSTALL = "pip install 'iga-nn[interop]'"


def read_json(text: str) -> tuple[list[BSplineVolume], list[tuple[Face, Face]]]:
    """Return the patches in a list of splines, which names no interfaces.

    splinepy checks degrees, knots and numbers of control points against each other, but trusts the rest of the file.
    Raises ValueError for damaged content, InputError where splinepy is missing.
    """
    splinepy = _splinepy()
    checked = _checked(text)
    with TemporaryDirectory() as folder:
        file = Path(folder, "splines.json")
        file.write_text(checked, encoding="utf-8")
        try:
            found = splinepy.io.json.load(str(file))
        except Exception as error:  # splinepy and its libraries raise a dozen kinds on damaged content
            raise ValueError(f"splinepy finds no spline in it ({one_line(error) or type(error).__name__})") from None
    patches = []
    for number, spline in enumerate(found):
        with faults_of(f"spline {number}"):
            patches.append(from_splinepy(spline))
    return patches, []


def _checked(text: str) -> str:
    """Return the list of splines without what is shown of them."""
    try:
        content = json.loads(text)
        splines = content["SplineList"]
        for spline in splines:
            if spline["para_dim"] != 3 or spline["dim"] != 3:
                raise ValueError("holds a spline that does not map 3 parameters to 3 coordinates")
            spline["show_options"] = {}
        if not splines:
            raise ValueError("holds no spline")
        return json.dumps(content)
    except (KeyError, TypeError, RecursionError, json.JSONDecodeError):
        raise ValueError("is not a list of splines as splinepy writes it") from None


def write_json(path: Path, spline: BodyLike | FieldOnBody, *_: object) -> None:
    """Write a volume, a body or a solution as splinepy's JSON, which has no place for more."""
    shown = spline.patches if isinstance(spline, FieldOnBody) else as_body(spline).patches
    _splinepy().io.json.export(str(path), [to_splinepy(one) for one in shown])


def from_splinepy(spline: Any) -> BSplineVolume:
    """Return the volume of a trivariate spline of splinepy. Raises TypeError for no spline, ValueError for others."""
    if not isinstance(spline, _splinepy().Spline):
        raise TypeError(f"spline must be one of splinepy's, got {type(spline).__name__}")
    if spline.para_dim != 3 or spline.dim != 3:
        raise ValueError(f"maps {spline.para_dim} parameters to {spline.dim} coordinates; a volume maps 3 to 3")
    full = spline.nurbs  # of every kind of spline
    rows = np.array(full.control_points, dtype=np.float64)
    knots = [np.array(row, dtype=np.float64) for row in full.knot_vectors]
    return patch_of([int(p) for p in full.degrees], knots, rows, np.asarray(full.weights).ravel())


def to_splinepy(spline: BSplineVolume | SplineField) -> Any:
    """Return a splinepy.BSpline of the same degrees, knots and coefficients, of a rational volume a splinepy.NURBS.

    Raises InputError where splinepy is missing.
    """
    splinepy, parts = _splinepy(), (list(spline.degrees), [row.tolist() for row in spline.knots])
    if isinstance(spline, SplineField):
        return splinepy.BSpline(*parts, fastest_first(spline.coefficients))
    if spline.weights is None:
        return splinepy.BSpline(*parts, fastest_first(spline.control_points))
    return splinepy.NURBS(*parts, fastest_first(spline.control_points), fastest_first(spline.weights))


def body_from_splinepy(splines: Any) -> Body:
    """Return the body of a splinepy.Multipatch, or of a list of splines; interfaces are those of the control points.

    Raises TypeError for other objects, ValueError where the splines are no volumes or do not fit together.
    """
    listed = splines.patches if isinstance(splines, _splinepy().Multipatch) else splines
    if not isinstance(listed, Iterable):
        raise TypeError(f"splines must be a splinepy.Multipatch or a list of splines, got {type(splines).__name__}")
    return Body.from_patches([from_splinepy(spline) for spline in listed])


def body_to_splinepy(body: Body) -> Any:
    """Return a body as a splinepy.Multipatch with its interfaces. Raises InputError without splinepy."""
    patches = _splinepy().Multipatch([to_splinepy(patch) for patch in body])
    neighbours = np.full((len(body), len(FACE_NAMES)), -1, dtype=np.int32)
    for interface in body.interfaces:
        _enter(neighbours, interface)
    patches.interfaces = neighbours
    return patches


def _enter(neighbours: Any, interface: Interface) -> None:
    """Enter an interface: each face gets the number of the other, six a patch; the boundary has -1."""
    first, second = ((patch, FACE_NAMES.index(face)) for patch, face in (interface.first, interface.second))
    for one, (patch, face) in ((first, second), (second, first)):
        neighbours[one] = len(FACE_NAMES) * patch + face


def _splinepy() -> Any:
    """Return the package splinepy. Raises InputError with the way to install it."""
    try:
        import splinepy
    except ImportError:
        raise InputError(f"splinepy is needed for this and is missing: {INSTALL}") from None
    logging.getLogger("splinepy").setLevel("ERROR")  # it warns that one patch has no neighbours
    return splinepy
