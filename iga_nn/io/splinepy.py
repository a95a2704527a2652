"""Reads and writes spline files of other programs through splinepy: G+Smo XML, MFEM NURBS meshes, splinepy JSON.

Each holds F(u, v, w) = sum P_ijk N_i(u) N_j(v) N_k(w) exactly: degrees, knot vectors, control points with every digit
of a double. All three count the control points with u fastest (volume.npz: w fastest), and knots run from 0 to 1.

- G+Smo: a `MultiPatch` of one `TensorBSpline3` geometry with id 100. The sides 1 to 6 are u0, u1, v0, v1, w0, w1.
- MFEM: "MFEM NURBS mesh v1.0", one patch, weights 1. The control points stand in MFEM's order of a patch: 8 vertices,
  12 edges, 6 faces, then the inside. Elements are the non-empty knot spans, u fastest, each with the reference
  coordinates (0, 1)^3 of its span. Boundary attributes 1 to 6 are w0, w1, v0, u1, v1, u0. With a solution the map is
  written on the solution's knots, and the solution's coefficients in the same order in a grid function beside it: one
  per row, three for displacements (VDim: 3, Ordering: 1). A left-handed volume, whose det J is negative, is written
  with w reversed, so that 1 and 2 are w1 and w0: MFEM would take det J for the weight of its integrals. G+Smo
  takes |det J|.
- JSON: splinepy's own list of splines, here one `BSpline`.

A solution u_h(u, v, w) has a file of its own in G+Smo's and splinepy's formats, on its own degrees and knots: a spline
of one coordinate, or of three for displacements (`geoDim`, `dim`).
"""

import logging
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from solve.field import SplineField

from ..errors import InputError, one_line
from .splinepy_gate import checked_text

log = logging.getLogger(__name__)

INSTALL = "pip install 'iga-nn[interop]'"
WEIGHTS_ALIKE = 1e-12  # relative


def write_gismo(path: Path, spline: BSplineVolume | SplineField, *_: object) -> None:
    """Write a volume or a solution as G+Smo XML, which has no place for more."""
    splinepy = _splinepy()
    patches = splinepy.Multipatch([to_splinepy(spline)])
    patches.interfaces = np.full((1, 6), -1)  # no neighbours: splinepy cannot look for those of scalar splines
    splinepy.io.gismo.export(str(path), patches)


def write_json(path: Path, spline: BSplineVolume | SplineField, *_: object) -> None:
    """Write a volume or a solution as splinepy's JSON, which has no place for more."""
    _splinepy().io.json.export(str(path), [to_splinepy(spline)])


def write_mfem(path: Path, volume: BSplineVolume, solution: SplineField | None = None, *_: object) -> None:
    """Write a volume as an MFEM NURBS mesh, on the knots of the solution where there is one.

    A left-handed volume is written with w reversed: MFEM takes det J itself for the weight of its integrals.
    """
    shown = volume if solution is None else _on_knots_of(solution, volume)
    spline = to_splinepy(shown)
    if orientation(volume) < 0:
        log.warning("the volume is left-handed, which MFEM does not take: written with w reversed, w0 and w1 exchanged")
        spline = to_splinepy(shown, reverse_w=True)
    _splinepy().io.mfem.export(str(path), spline.nurbs)


def write_mfem_field(path: Path, field: SplineField, volume: BSplineVolume) -> None:
    """Write a solution as an MFEM grid function on the mesh that `write_mfem` makes of it and its volume."""
    spline = to_splinepy(field, reverse_w=orientation(volume) < 0)
    order, _ = _splinepy().io.mfem.dof_mapping(spline)
    values = np.asarray(spline.control_points)[order]  # (m, 1) or (m, 3)
    head = ["FiniteElementSpace", "FiniteElementCollection: NURBS", f"VDim: {values.shape[1]}", "Ordering: 1", ""]
    rows = (" ".join(map(repr, row)) for row in values.tolist())
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")


def _on_knots_of(field: SplineField, volume: BSplineVolume) -> BSplineVolume:
    """Return the same map with the knots of a solution on it inserted. Raises InputError where the degrees differ."""
    if field.degrees != volume.degrees:
        raise InputError(
            f"an MFEM mesh takes only solutions of its own degrees {volume.degrees}, this one has {field.degrees}: "
            "export it --to vtk"
        )
    return volume.on_knots(field.knots)


def read(path: Path, kind: str) -> BSplineVolume:
    """Return the one trivariate spline of a file, its knots scaled to run from 0 to 1; the map stays.

    kind: "gismo", "mfem" or "json". Raises InputError where splinepy is missing, OSError, and ValueError where the
    file does not hold one trivariate B-spline: several patches, weights that differ, damaged content.
    """
    splinepy = _splinepy()
    try:
        text = checked_text(path, kind)
        spline = _load(splinepy, text, kind)
        return from_splinepy(spline)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _load(splinepy: Any, text: str, kind: str) -> Any:
    with TemporaryDirectory() as folder:
        checked = Path(folder, "spline")
        checked.write_text(text, encoding="utf-8")
        try:
            found = getattr(splinepy.io, kind).load(str(checked))
            return {"gismo": lambda: found[0].patches[0], "mfem": lambda: found, "json": lambda: found[0]}[kind]()
        except Exception as error:  # splinepy and its libraries raise a dozen kinds on damaged content
            raise ValueError(f"splinepy finds no spline in it ({one_line(error) or type(error).__name__})") from None


def from_splinepy(spline: Any) -> BSplineVolume:
    """Return the volume of a trivariate B-spline of splinepy. Raises TypeError for no spline, ValueError for others."""
    if not isinstance(spline, _splinepy().Spline):
        raise TypeError(f"spline must be one of splinepy's, got {type(spline).__name__}")
    if spline.para_dim != 3 or spline.dim != 3:
        raise ValueError(f"maps {spline.para_dim} parameters to {spline.dim} coordinates; a volume maps 3 to 3")
    full = spline.nurbs  # of every kind of spline
    weights = np.asarray(full.weights)
    if not 0.0 < weights.max() <= (1.0 + WEIGHTS_ALIKE) * weights.min():  # refuses NaN, too
        raise ValueError("is rational: its weights are not all equal and positive; only polynomial splines are taken")
    rows = np.array(full.control_points, dtype=np.float64)
    net = rows.reshape(*reversed(full.control_mesh_resolutions), 3).transpose(2, 1, 0, 3)
    knots = [np.array(row, dtype=np.float64) for row in full.knot_vectors]
    if not all(np.all(np.isfinite(row)) and row[-1] > row[0] for row in knots):
        raise ValueError("knots must be finite and span an interval")
    k_u, k_v, k_w = ((row - row[0]) / (row[-1] - row[0]) for row in knots)
    p_u, p_v, p_w = (int(p) for p in full.degrees)
    return BSplineVolume((p_u, p_v, p_w), (k_u, k_v, k_w), np.ascontiguousarray(net))


def _splinepy() -> Any:
    """Return the package splinepy. Raises InputError with the way to install it."""
    try:
        import splinepy
    except ImportError:
        raise InputError(f"splinepy is needed for this and is missing: {INSTALL}") from None
    logging.getLogger("splinepy").setLevel("ERROR")  # it warns that one patch has no neighbours
    return splinepy


def to_splinepy(spline: BSplineVolume | SplineField, *, reverse_w: bool = False) -> Any:
    """Return a splinepy.BSpline of the same degrees, knots and coefficients. Raises InputError without splinepy.

    reverse_w: whether w is replaced by 1 - w.
    """
    net = spline.control_points if isinstance(spline, BSplineVolume) else spline.coefficients
    knots = [row.tolist() for row in spline.knots]
    if reverse_w:
        net, knots[2] = net[:, :, ::-1], (1.0 - spline.knots[2][::-1]).tolist()
    rows = net.transpose(2, 1, 0, *range(3, net.ndim)).reshape(np.prod(net.shape[:3]), -1)  # u fastest
    return _splinepy().BSpline(list(spline.degrees), knots, rows)
