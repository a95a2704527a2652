"""STEP and IGES by OpenCASCADE, in the package cadquery-ocp-novtk: faces of the B-rep become groups face1, face2, ...

It runs in a process of its own (`opencascade.py`): on a damaged file the library may end it, and it prints as it likes.
It works in millimetres; lengths are brought back to the unit of the file.
"""

import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ..errors import MeshError, check_face_count
from ..groups import gathered
from .common import DAMAGED, Content

INSTALL = "pip install 'iga-nn[cad]'"
PROGRAM = Path(__file__).with_name("opencascade.py")
PATIENCE = 300.0  # seconds
ANGLE = 0.2  # radians between neighbouring triangles of a curved face: some 31 around a full turn
SHARE = 1e-3  # of the box's diagonal: the deflection where none is given
UNITS = {"MICRO": ("micron", 1e-3), "MILLI": ("mm", 1.0), "CENTI": ("cm", 10.0), "DECI": ("dm", 100.0)}
UNITS |= {"": ("m", 1000.0), "INCH": ("in", 25.4), "FOOT": ("ft", 304.8)}  # name, millimetres
METRIC = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.\s*\)")
CONVERTED = re.compile(rb"CONVERSION_BASED_UNIT\s*\(\s*'(INCH|FOOT)", re.IGNORECASE)

IGES_UNIT = re.compile(rb",\s*\d{1,2}\s*,\s*\d+H(INCH|IN|FT|MM|CM|M)\s*,")  # parameters 14 and 15 of the section G
IGES_NAMES = {b"INCH": "INCH", b"IN": "INCH", b"FT": "FOOT", b"MM": "MILLI", b"CM": "CENTI", b"M": ""}


def read_step(data: bytes, max_faces: int, deflection: float | None = None) -> Content:
    """Read a .step. deflection: largest distance of the triangles from curved faces, in the file's unit."""
    if b"ISO-10303-21" not in data[:4096]:
        raise MeshError(f"not a STEP file: it does not begin with ISO-10303-21; {DAMAGED}")
    found = METRIC.search(data)
    named = (found[1] or b"").decode() if found else "MILLI"
    if other := CONVERTED.search(data):
        named = other[1].decode().upper()
    if named not in UNITS:
        raise MeshError(f"the unit of lengths {named[:20].lower()}metre is not known: export it in millimetres")
    return _read(data, "step", max_faces, deflection, *UNITS[named])


def read_iges(data: bytes, max_faces: int, deflection: float | None = None) -> Content:
    """Read a .iges as `read_step` reads a .step; in millimetres where it names no unit."""
    lines = data.replace(b"\r", b"").split(b"\n")
    found = IGES_UNIT.search(b"".join(line[:72] for line in lines if line[72:73] == b"G"))
    named = IGES_NAMES[found[1]] if found else "MILLI"
    return _read(data, "iges", max_faces, deflection, *UNITS[named])


def _read(data: bytes, kind: str, max_faces: int, deflection: float | None, unit: str, millimetres: float) -> Content:
    """Return the triangles of a file, in the unit that has so many millimetres."""
    if deflection is not None and not 0.0 < deflection < np.inf:
        raise MeshError(f"deflection must be a positive length, got {deflection!r:.40}")
    if find_spec("OCP") is None:
        raise MeshError(f"reading .{kind} needs OpenCASCADE, which is not installed: {INSTALL}")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "source"), Path(folder, "target.npz")
        source.write_bytes(data)
        wanted = repr(0.0 if deflection is None else deflection * millimetres)
        command = [sys.executable, str(PROGRAM), str(source), str(target), kind, wanted, repr(SHARE), repr(ANGLE)]
        try:
            ended = subprocess.run(
                command, capture_output=True, timeout=PATIENCE, check=False, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            raise MeshError(f"OpenCASCADE takes more than {PATIENCE:.0f} s: export triangles instead") from None
        if ended.returncode > 0:  # of Python: the library itself ends it by a signal
            said = ended.stderr.decode(errors="replace").strip().splitlines()
            raise MeshError(f"OpenCASCADE failed on it ({''.join(said[-1:])[:120]}): export triangles instead")
        if not target.exists():
            raise MeshError(f"OpenCASCADE cannot read it as {kind.upper()}; {DAMAGED}")
        with np.load(target) as arrays:
            vertices, faces, labels = (arrays[name] for name in ("vertices", "faces", "labels"))
    if not len(faces):
        raise MeshError("has no faces that bound a body: export the solid")
    check_face_count(len(faces), max_faces)
    groups = gathered((f"face{value}", np.flatnonzero(labels == value)) for value in np.unique(labels).tolist())
    return Content(vertices / millimetres, faces.tolist(), groups=groups, unit=unit)
