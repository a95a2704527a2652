"""Reads volumes from the files of other programs, whose table stands in `io.kinds`; `io.export` writes them.

docs/output.md explains our own files, NumPy archives without pickles. `io.gismo`, `io.mfem`, `io.splinepy` and
`io.geopdes` explain the formats.
"""

import logging
from pathlib import Path

import numpy as np

from parameterize.arrays import listed
from parameterize.spline.body import TOLERANCE, Body, BodyLike

from ..errors import InputError, input_errors
from ..type_check import check_type
from .beginnings import kind_of
from .kinds import FORMATS, read_body
from .meshes import ENDINGS as MESHES
from .meshes import find_mesh
from .words import faults_of

log = logging.getLogger(__name__)

SHOWN = 3  # pairs of faces in a notice
NARROWEST = 1e-100  # knot span: with the largest control points, derivatives stay within double precision


def volume_file(given: str | Path) -> Path:
    """Return the file of a volume that is named by itself, or by the output folder of a run that holds it."""
    path = Path(given)
    inside = path / "volume.npz"
    return inside if path.is_dir() and inside.is_file() else path


def load_volume(path: str | Path, tolerance: float = TOLERANCE) -> BodyLike:
    """Return the volume of a volume.npz, G+Smo XML, MFEM NURBS mesh, GeoPDEs geometry file or splinepy JSON.

    These kinds are recognized by their beginnings. Of a mesh of elements (see `load_mesh`) each hexahedron becomes a
    patch, and each tetrahedron four, exactly.

    Parameters
    ----------
    path : str or Path
        The file.
    tolerance : float
        The largest distance of two control points on faces of patches that are taken for one, as a share of the body's
        size. volume.npz names its interfaces, whose control points are the same.

    Returns
    -------
    BSplineVolume or Body
        A Body of a file with several patches, or with one that is glued to itself.

    Raises
    ------
    InputError
        Where the file has no such format or is damaged, where its patches do not fit together, and where splinepy,
        which reads JSON, is missing.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> benchmark_volume(2).save("volume.npz")
    >>> iga_nn.load_volume("volume.npz").degrees
    (3, 3, 3)
    """
    check_type("path", path, str | Path)
    check_type("tolerance", tolerance, float)
    if not 0.0 <= tolerance < 1.0:
        raise InputError(f"tolerance {tolerance}: must be 0 or larger, and smaller than 1, the body's size")
    if path == "":
        raise InputError("no volume is named: give a volume.npz, or a file of another program")
    source = Path(path)
    if source.is_dir():
        raise InputError(f"{source}: is a folder: name the volume.npz in it")
    with input_errors():
        body = _read(source, tolerance)
    if near := body.nearly_glued:
        pairs = listed([f"{pair} ({distance:.2g} apart)" for pair, distance in near], SHOWN)
        log.warning("%s: faces that nearly match are not glued: %s; a larger tolerance glues them", path, pairs)
    rows = [row for patch in body for row in patch.knots]
    if min(float(np.diff(np.unique(row)).min()) for row in rows) < NARROWEST:
        raise InputError(f"{path}: has a knot span narrower than {NARROWEST:g}: derivatives there overflow; widen it")
    return body.simplest


def _read(source: Path, tolerance: float) -> Body:
    """Return the body of a file, also of a mesh of elements. Raises OSError and ValueError."""
    kind = kind_of(source) if source.is_file() else "npz"
    if kind in FORMATS:
        return read_body(source, kind, tolerance)
    if kind is None and source.suffix.lower() in MESHES and (mesh := find_mesh(source)) is not None:
        from .mesh_body import body_of_mesh

        with faults_of(source):
            return body_of_mesh(mesh)
    if kind is None and source.suffix != ".npz":
        raise InputError(f"{source}: is not a spline volume; create one with `iga-nn run poisson {source}`")
    return Body.load(source)
