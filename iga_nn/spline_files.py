"""Spline files of other programs, read and written through splinepy: G+Smo XML, MFEM NURBS meshes, splinepy JSON.

Each holds F(u, v, w) = sum P_ijk N_i(u) N_j(v) N_k(w) exactly: degrees, knot vectors, control points, every digit of a
double. All three count the control points with u fastest (volume.npz: w fastest), and knots run from 0 to 1.

- G+Smo: a `MultiPatch` of one `TensorBSpline3` geometry with id 100. The sides 1 to 6 are u0, u1, v0, v1, w0, w1.
- MFEM: "MFEM NURBS mesh v1.0", one patch, weights 1. The control points stand in MFEM's order of a patch: 8 vertices,
  12 edges, 6 faces, then the inside. Elements are the non-empty knot spans, u fastest, each with the reference
  coordinates (0, 1)^3 of its span. Boundary attributes 1 to 6 are w0, w1, v0, u1, v1, u0.
- JSON: splinepy's own list of splines, here one `BSpline`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from parameterize.volume import BSplineVolume

from .options import InputError

INSTALL = "pip install 'iga-nn[interop]'"


def write_mfem(path: Path, volume: BSplineVolume) -> None:
    """Write an MFEM NURBS mesh."""
    _splinepy().io.mfem.export(str(path), _to_splinepy(volume).nurbs)


def _splinepy() -> Any:
    """The package splinepy. Raises InputError with the way to install it."""
    try:
        import splinepy
    except ImportError:
        raise InputError(f"this format is read and written through splinepy, which is missing: {INSTALL}") from None
    return splinepy


def _to_splinepy(volume: BSplineVolume) -> Any:
    rows = volume.control_points.transpose(2, 1, 0, 3).reshape(-1, 3)  # u fastest
    return _splinepy().BSpline(list(volume.degrees), [knots.tolist() for knots in volume.knots], rows)
