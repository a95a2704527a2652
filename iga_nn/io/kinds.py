"""The table of volume files of other programs: writes and reads them."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parameterize.spline.body import Body
from parameterize.spline.interface import Face
from parameterize.spline.volume import BSplineVolume

from . import geopdes, gismo, mfem, mfem_writer, splinepy, view, vtk
from .patches_of_files import body_of
from .words import faults_of, text_of

Content = tuple[Sequence[BSplineVolume], Iterable[tuple[Face, Face]]]  # patches, and faces that are declared glued


@dataclass(frozen=True)
class Format:
    """Hold a format of another program: a row of the table of volumes.

    ending: of its files, after the volume's stem where they are written. write: puts the volume into a file; it is also
    given the solution and its problem, None where there are none, and the samples and quantities of a view. beside:
    ending and writer of a second file, where the solution needs one; it is given the volume, too. read: makes patches
    of a text, which begins as a row of `io.beginnings` says.
    """

    ending: str
    write: Callable[..., None] | None = None
    beside: tuple[str, Callable[[Path, Any, Any], None]] | None = None
    read: Callable[[str], Content] | None = None


FORMATS = {
    "gismo": Format(".xml", gismo.write_gismo, ("_u.xml", gismo.write_gismo_field), gismo.read_gismo),
    "mfem": Format(".mesh", mfem_writer.write_mfem, (".gf", mfem_writer.write_mfem_field), mfem.read_mfem),
    "geopdes": Format(".txt", read=geopdes.read_geopdes),
    "vtk": Format("_bezier.vtu", vtk.write_bezier),
    "view": Format("_view.vtu", view.write_view),
    "json": Format(".json", splinepy.write_json, ("_u.json", splinepy.write_json), splinepy.read_json),
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
