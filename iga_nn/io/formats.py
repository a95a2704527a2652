"""Reads and writes volumes in the files of other programs, whose table stands in `io.kinds`.

docs/output.md explains our own files, NumPy archives without pickles.

A solution, scalar or a displacement, is exported with its volume into every format: `vtk` and `view` hold it as the
point data `u`, the others as a second file beside the volume's. `io.gismo`, `io.mfem`, `io.mfem_writer` and
`io.splinepy` explain the formats that are also read, `io.geopdes` one that is only read; `io.vtk` and `io.view` those
for ParaView. IGES and STEP have no trivariate splines.
"""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import listed
from parameterize.files import replacing
from parameterize.spline.body import TOLERANCE, Body, BodyLike, as_body, shared_numbers
from parameterize.spline.volume import BSplineVolume
from solve.discretization.space import TrialSpace, longest_edges
from solve.field import BodyField, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem

from ..errors import InputError, did_you_mean, input_errors
from ..new_file import check_new
from ..options import PROBLEMS
from ..report import document as reports
from ..type_check import check_type
from .beginnings import kind_of
from .kinds import FORMATS, read_body

log = logging.getLogger(__name__)

SHOWN = 3  # pairs of faces in a notice
NARROWEST = 1e-100  # knot span: with the largest control points, derivatives stay within double precision


def load_volume(path: str | Path, tolerance: float = TOLERANCE) -> BodyLike:
    """Return the volume of a volume.npz, G+Smo XML, MFEM NURBS mesh, GeoPDEs geometry file or splinepy JSON.

    The kinds are recognized by their beginnings.

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
        kind = kind_of(source) if source.is_file() else "npz"
        if kind is None and source.suffix != ".npz":
            raise InputError(f"{source}: is not a spline volume; create one with `iga-nn run poisson {source}`")
        body = read_body(source, kind, tolerance) if kind in FORMATS else Body.load(source)
    if near := body.nearly_glued:
        pairs = listed([f"{pair} ({distance:.2g} apart)" for pair, distance in near], SHOWN)
        log.warning("%s: faces that nearly match are not glued: %s; a larger tolerance glues them", path, pairs)
    rows = [row for patch in body for row in patch.knots]
    if min(float(np.diff(np.unique(row)).min()) for row in rows) < NARROWEST:
        raise InputError(f"{path}: has a knot span narrower than {NARROWEST:g}: derivatives there overflow; widen it")
    return body.simplest


def export(
    volume: str | Path,
    to: str,
    out: str | Path | None = None,
    *,
    solution: str | Path | None = None,
    samples: int | None = None,
    quantity: Iterable[str] = (),
    force: bool = False,
) -> Path:
    """Write the volume of a file in another format and return the path written; atomic.

    Parameters
    ----------
    volume : str or Path
        File with the volume.
    to : str
        "gismo", "mfem", "vtk", "view" or "json".
    out : str or Path, optional
        By default the volume's stem with the format's ending, in the current folder.
    solution : str or Path, optional
        solution.npz of a solve on this volume. By the report.json beside it, the view knows its law, and shows the
        error, where there is an exact solution, and stress and von_mises of elasticity, gradient and flux of Poisson's
        equation. With G+Smo, MFEM and splinepy's JSON it is a file of its own, NAME_u.xml, NAME.gf, NAME_u.json.
    samples : int, optional
        Of a view: cells a span of the solution and direction; by default 3, fewer where they were more than a million.
    quantity : names, optional
        Of a view: other quantities of the law, by their names, such as "principal".
    force : bool
        Replace a file that exists.

    Raises
    ------
    InputError
        Where a file cannot be read or written, exists (unless `force`), or a package is missing.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> benchmark_volume(2).save("volume.npz")
    >>> iga_nn.export("volume.npz", "view", "seen.vtu").name
    'seen.vtu'
    """
    for name, value, kind in (("volume", volume, str | Path), ("to", to, str), ("out", out, str | Path | None)):
        check_type(name, value, kind)
    if to != "view" and (samples is not None or quantity):
        raise InputError(f"format {to!r}: samples and quantities are for --to view")
    if samples is not None and samples < 1:
        raise InputError(f"samples {samples}: must be 1 or larger")
    chosen = FORMATS.get(to)
    if chosen is None or chosen.write is None:
        written = [name for name, kind in FORMATS.items() if kind.write is not None]
        known = f"choose one of {', '.join(written)}; IGES and STEP have no trivariate splines"
        raise InputError(f"format {to!r}: {known}{did_you_mean(to, written)}")
    target = check_new(
        Path(volume).stem + chosen.ending if out is None else out, chosen.ending[chosen.ending.index(".") :]
    )
    field_ending, write_field = chosen.beside if solution and chosen.beside else ("", None)
    beside = target.with_name(target.stem + field_ending) if write_field else target
    for file in (target, beside):
        if file.exists() and not force:
            raise InputError(f"{file}: exists; --force replaces it, --out names another file")
    loaded = load_volume(volume)
    if solution is not None and to == "mfem" and not as_body(loaded).is_single:
        raise InputError(f"{volume}: has several patches; a solution on these goes to vtk, view, gismo or json")
    field, problem = (None, None) if solution is None else _load_solution(Path(solution), loaded)
    try:
        with replacing(target) as temporary:
            chosen.write(temporary, loaded, field, problem, samples, tuple(quantity) or None)
            if field is not None and write_field is not None:
                with replacing(beside) as temporary_beside:
                    write_field(temporary_beside, field, loaded)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}): choose another with --out") from None
    return target


def _load_solution(path: Path, body: BodyLike) -> tuple[BodyField, BoundaryValueProblem | None]:
    """Return a solution and the problem in the report beside it, None for a problem that is not known.

    Raises InputError where the solution does not belong to the body: by its knots, or by the h of its report.
    """
    several = as_body(body)
    with input_errors():
        found = BodyField.load(path)
    fields = found.patches
    if any(field.coefficients.shape[3:] not in ((), (3,)) for field in fields):
        raise InputError(f"{path}: coefficients must have shape (m_u, m_v, m_w) or (.., 3)")
    if len(fields) != len(several) or not all(map(_is_refined, several, fields)):
        raise InputError(f"{path}: belongs to another volume: its knots are not those of the map, refined")
    report = reports.read(path.parent) or {}
    name = next((name for name in PROBLEMS if isinstance(report.get(name), dict)), "")
    section = report.get(name, {})
    if (there := _mesh_size(section, several, fields)) is not None:
        spaces = (TrialSpace(field.degrees, field.knots) for field in fields)
        here = longest_edges(several.patches, list(spaces))
        if not np.isclose(here, there, rtol=1e-9):
            raise InputError(
                f"{path}: belongs to another volume: the longest edge of its elements is {there:.6g}, here {here:.6g}"
            )
    return found, _stated(name, section) if name else None


def _is_refined(volume: BSplineVolume, field: SplineField) -> bool:
    return all(np.isin(own, finer).all() for own, finer in zip(volume.knots, field.knots, strict=True))


def _stated(name: str, section: dict[str, Any]) -> BoundaryValueProblem | None:
    """Return the problem of a report's section, None where its options are damaged, or of another version."""
    kind = PROBLEMS[name]
    known = {field.name for field in fields(kind)} & section.keys()
    given: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in section.items()
    }
    try:
        return kind(**{name: given[name] for name in known}).problem()
    except InputError:
        return None


def _mesh_size(section: dict[str, Any], body: Body, fields: Sequence[SplineField]) -> float | None:
    """Return h of the finest level, None where the section is not the fields', is empty or was edited."""
    try:
        count = shared_numbers([field.coefficients.shape for field in fields], body.interfaces)[1]
        finest = section["levels"][-1]
        return float(finest["h"]) if finest["dofs"] == count else None
    except (LookupError, TypeError, ValueError):
        return None
