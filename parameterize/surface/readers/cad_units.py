"""The unit of lengths in the text of a STEP or IGES file.

STEP: ISO 10303-21 has the text, ISO 10303-41 the units. IGES: section 2.2.4.3 of IGES 5.3, parameters 14 and 15.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import MeshError
from .common import DAMAGED

INCH = 25.4  # millimetres
PREFIXES = {"ATTO": ("a", -18), "FEMTO": ("f", -15), "PICO": ("p", -12), "NANO": ("n", -9), "MICRO": ("micr", -6)}
PREFIXES |= {"MILLI": ("m", -3), "CENTI": ("c", -2), "DECI": ("d", -1), "": ("", 0), "DECA": ("da", 1)}
PREFIXES |= {"HECTO": ("h", 2), "KILO": ("k", 3), "MEGA": ("M", 6), "GIGA": ("G", 9), "TERA": ("T", 12)}
PREFIXES |= {"PETA": ("P", 15), "EXA": ("E", 18)}  # symbol, power of ten
METRES = {prefix: 10.0 ** (power + 3) for prefix, (_, power) in PREFIXES.items()}  # millimetres
NAMES = {f"{symbol}m": METRES[prefix] for prefix, (symbol, _) in PREFIXES.items() if prefix != "MICRO"}
NAMES |= {"micron": 1e-3, "in": INCH, "ft": 12 * INCH, "yd": 36 * INCH, "mi": 63360 * INCH, "mil": 1e-3 * INCH}
NAMES |= {"microinch": 1e-6 * INCH}
SAME = 1e-7  # relative: two units are one; the survey foot differs from the foot by 2e-6

# The context of a shape of solids, whose unit is the file's.
SOLIDS = re.compile(rb"BREP_SHAPE_REPRESENTATION\s*\(\s*(?:'[^']{0,400}+')+\s*,\s*\([^()]*+\)\s*,\s*#(\d{1,18})\s*\)")
# Those that matter are short, so that a text without an end takes no time.
ENTITY = re.compile(rb"#(\d{1,18})\s*=\s*((?:[^';#]{1,400}+|#|'[^']{0,400}+'){1,200}+);")
COMMENT = re.compile(rb"('[^']*+')|/\*.{0,2000}?\*/", re.DOTALL)
CONTEXT = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^()]*)\)")
METRIC = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.\s*\)")
CONVERTED = re.compile(rb"CONVERSION_BASED_UNIT\s*\(\s*'([^']{0,80})'\s*,\s*#(\d{1,18})")
MEASURE = re.compile(
    rb"MEASURE(?:_WITH_UNIT)?\s*\(\s*([-+]?\d{1,30}\.?\d{0,30}(?:E[-+]?\d{1,3})?)\s*\)?\s*,\s*#(\d{1,18})"
)  # some write no type

FLAGS = {1: "IN", 2: "MM", 4: "FT", 5: "MI", 6: "M", 7: "KM", 8: "MIL", 9: "UM", 10: "CM", 11: "UIN"}
BY_NAME = (0, 3)  # flags; 0 is none of the standard, and is read by its name, too
IGES_NAMES = {"IN": "in", "INCH": "in", "MM": "mm", "FT": "ft", "MI": "mi", "M": "m", "KM": "km", "MIL": "mil"}
IGES_NAMES |= {"UM": "micron", "CM": "cm", "UIN": "microinch", "YD": "yd", "YARD": "yd"}
READ = ("INCH", *FLAGS.values())  # names that OpenCASCADE knows; it leaves lengths of others as they are
HOLLERITH = re.compile(r"\s*(\d{1,5})H")  # a text begins with the number of its letters
SCALE, FLAG, NAME = 13, 14, 15  # numbers of parameters


@dataclass(frozen=True)
class Unit:
    """A unit of lengths, with the millimetres that OpenCASCADE takes it for; notices: of a unit that is not kept."""

    name: str = "mm"
    millimetres: float = 1.0
    notices: tuple[str, ...] = ()

    @property
    def working(self) -> float:
        """Return the millimetres of the unit in which OpenCASCADE is to work: its tolerances are lengths of about 1."""
        return min(1.0, self.millimetres)

    @property
    def factor(self) -> float:
        """Return how many of the working unit this one has."""
        return self.millimetres / self.working


def step_unit(data: bytes) -> Unit:
    """Return the unit of a STEP file; millimetres with a notice where it has none, several, or one without a name."""
    units = _lengths(data)
    if not units:
        return _instead("the file names no unit")
    if len(units) > 1:
        names = sorted(_name_of(size) or named[:40] for size, named in units.items())
        return _instead(f"the file has several units ({', '.join(names)})")
    ((millimetres, named),) = units.items()
    name = _name_of(millimetres)
    if name is None:
        return _instead(f"the file's unit, {named[:40]!r} of {millimetres:g} mm, has no name here")
    return Unit(name, NAMES[name])


def iges_unit(data: bytes) -> Unit:
    """Return the unit of an IGES file, or millimetres with a notice where its name is not known.

    Raises MeshError for a flag that is none of the standard: OpenCASCADE would make all lengths 0.
    """
    parameters = dict(enumerate(_parameters(data), start=1))
    if not parameters:
        raise MeshError(f"not an IGES file: it has no section G; {DAMAGED}")
    flag, named = parameters.get(FLAG) or "1", parameters.get(NAME, "").strip().upper()
    known = int(flag) if re.fullmatch(r"\d{1,3}", flag, re.ASCII) else -1
    if known not in (*FLAGS, *BY_NAME):
        raise MeshError(f"the flag {flag[:20]!r} of its unit is none of IGES, which has 1 to 11; {DAMAGED}")
    notices = _scale(parameters.get(SCALE) or "1")
    named = FLAGS.get(known, named)
    if named not in IGES_NAMES:
        said = f"its unit {named[:40]!r} is not known" if named else "the file names no unit"
        return Unit(notices=(f"lengths are taken as mm: {said}", *notices))
    name = IGES_NAMES[named]
    return Unit(name, NAMES[name] if named in READ else 1.0, notices)


def _instead(why: str) -> Unit:
    return Unit(notices=(f"lengths are in mm: {why}",))


def _name_of(millimetres: float) -> str | None:
    """Return the name of a unit of so many millimetres, None where it has none here."""
    near = (name for name, size in NAMES.items() if math.isclose(size, millimetres, rel_tol=SAME))
    return next(near, None)


def _lengths(data: bytes) -> dict[float, str]:
    """Return the distinct units of lengths of the solids, else of all shapes: millimetres, and the name in the file."""
    text = COMMENT.sub(rb"\1", data) if b"/*" in data else data
    entities = {int(found[1]): found[2] for found in ENTITY.finditer(text) if b"UNIT" in found[2]}
    contexts = {number: found[1] for number, entity in entities.items() if (found := CONTEXT.search(entity))}
    solids = {int(found[1]) for found in SOLIDS.finditer(text)} or contexts.keys()
    numbers = {int(word) for k in solids for word in re.findall(rb"#(\d{1,18})", contexts.get(k, b""))}
    units: dict[float, str] = {}
    for size, named in filter(None, (_length(entities, number) for number in sorted(numbers))):
        if not any(math.isclose(size, other, rel_tol=SAME) for other in units):
            units[size] = named
    return units


def _length(entities: Mapping[int, bytes], number: int) -> tuple[float, str] | None:
    """Return the millimetres of a unit and its name in the file, None where it is no unit of lengths.

    Raises MeshError for one that is converted twice: OpenCASCADE would take it for millimetres.
    """
    text = entities.get(number, b"")
    if (found := METRIC.search(text)) and (prefix := (found[1] or b"").decode()) in METRES:
        return METRES[prefix], f"{prefix}METRE".lower()
    converted = CONVERTED.search(text)
    measure = MEASURE.search(entities.get(int(converted[2]), b"")) if converted else None
    if converted is None or measure is None:
        return None
    name, base = converted[1].decode("latin-1"), entities.get(int(measure[2]), b"")
    if CONVERTED.search(base) and b"LENGTH_UNIT" in base:
        raise MeshError(f"its unit {name[:40]!r} is given in a unit that is no SI unit: export it in millimetres")
    metric = METRIC.search(base)
    size = float(measure[1]) * METRES.get((metric[1] or b"").decode(), 0.0) if metric else 0.0
    return (size, name) if 0.0 < size < math.inf else None


def _scale(word: str) -> tuple[str, ...]:
    """Return a notice of a model space scale that is not 1: OpenCASCADE does not read it."""
    try:
        scale = float(word.upper().replace("D", "E"))
    except ValueError:
        return ()
    return () if scale == 1.0 else (f"the file's model space scale of {scale:g} is not applied",)


def _parameters(data: bytes) -> list[str]:
    """Return the parameters of the section G of an IGES file, up to the name of the unit."""
    lines = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    text = b"".join(line[:72] for line in lines if line[72:73] == b"G").decode("latin-1")
    found: list[str] = []
    signs, at = [",", ";"], 0  # the first two parameters give others
    while at < len(text) and len(found) < NAME:
        letters = HOLLERITH.match(text, at)
        start = letters.end() if letters else at
        stop = start + int(letters[1]) if letters else at
        if letters and len(found) < len(signs):
            signs[len(found)] = text[start:stop]
        end = min((place for sign in signs if (place := text.find(sign, stop)) >= 0), default=len(text))
        found.append(text[start:stop] if letters else text[at:end].strip())
        if text[end : end + 1] == signs[1]:
            break
        at = end + 1
    return found
