"""The table of volume files of other programs: writes and reads them."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parameterize.spline.body import Body, BodyLike
from parameterize.spline.interface import Face
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.part import PartSurface
from solve.field import FieldOnBody
from solve.forms.boundary_value_problem import BoundaryValueProblem

from . import bezier, boundary_faces, calculix, geopdes, gismo, gmsh, mfem, mfem_writer, splinepy, view, vtk
from .patches_of_files import body_of
from .words import faults_of, text_of

Content = tuple[Sequence[BSplineVolume], Iterable[tuple[Face, Face]]]  # patches, and faces that are declared glued


@dataclass(frozen=True, eq=False)
class Exported:
    """Hold what is written: a body, its solution and problem, the surface of its part, None where there are none.

    samples, quantities and element: as in `io.export.export`.
    """

    body: BodyLike
    solution: FieldOnBody | None = None
    problem: BoundaryValueProblem | None = None
    part: PartSurface | None = None
    samples: int | None = None
    quantities: tuple[str, ...] | None = None
    element: str | None = None


@dataclass(frozen=True)
class Format:
    """Hold a format of another program: a row of the table of volumes.

    ending: of its files, after the volume's stem where they are written. write: puts the volume and what belongs to it
    into a file. beside: ending and writer of a second file, where the solution needs one; it is given the volume, too.
    read: makes patches of a text, which begins as a row of `io.beginnings` says. takes: options of `export` that it
    has. holds_solution: whether a solution or its problem has a place.
    """

    ending: str
    write: Callable[[Path, Exported], None] | None = None
    beside: tuple[str, Callable[[Path, Any, Any], None]] | None = None
    read: Callable[[str], Content] | None = None
    takes: tuple[str, ...] = ()
    holds_solution: bool = True


def _view(path: Path, given: Exported) -> None:
    view.write_view(path, given.body, given.solution, given.problem, given.samples, given.quantities, given.part)


def _calculix(path: Path, given: Exported) -> None:
    calculix.write_calculix(
        path, given.body, given.problem, given.part, parts=given.samples or 1, element=given.element or "C3D20"
    )


def _gmsh(path: Path, given: Exported) -> None:
    more = {"parts": given.samples or 1, "element": given.element or "hex64"}
    gmsh.write_gmsh(path, given.body, given.solution, given.problem, given.part, **more)  # type: ignore[arg-type]


FORMATS = {
    "gismo": Format(
        ".xml",
        lambda path, given: gismo.write_gismo(path, given.body),
        ("_u.xml", gismo.write_gismo_field),
        gismo.read_gismo,
    ),
    "mfem": Format(
        ".mesh",
        lambda path, given: mfem_writer.write_mfem(path, given.body, given.solution),
        (".gf", mfem_writer.write_mfem_field),
        mfem.read_mfem,
    ),
    "geopdes": Format(".txt", read=geopdes.read_geopdes),
    "vtk": Format(
        "_bezier.vtu", lambda path, given: vtk.write_bezier(path, given.body, given.solution, given.problem, given.part)
    ),
    "view": Format("_view.vtu", _view, takes=("samples", "quantity")),
    "json": Format(
        ".json",
        lambda path, given: splinepy.write_json(path, given.body),
        ("_u.json", splinepy.write_json),
        splinepy.read_json,
    ),
    "calculix": Format(".inp", _calculix, takes=("samples", "element")),
    "gmsh": Format(".msh", _gmsh, takes=("samples", "element")),
    "bezier": Format(
        ".bext", lambda path, given: bezier.write_bezier_extraction(path, given.body), holds_solution=False
    ),
    "step": Format(".step", lambda path, given: boundary_faces.write_step(path, given.body), holds_solution=False),
    "iges": Format(".igs", lambda path, given: boundary_faces.write_iges(path, given.body), holds_solution=False),
}


def read_body(path: Path, kind: str, tolerance: float) -> Body:
    """Return the body of a file, of several patches with their interfaces.

    kind: one of FORMATS that is read. tolerance: as in `Body.from_patches`. Raises OSError, and ValueError where the
    file is damaged, or its patches do not fit together.
    """
    read = FORMATS[kind].read
    assert read is not None  # as `beginnings.kind_of` finds it
    with faults_of(path):
        return body_of(*read(text_of(path)), tolerance)
