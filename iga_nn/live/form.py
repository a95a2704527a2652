"""Reads the live page's form of a problem: Poisson's equation, or an elastic body."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from parameterize.spline.volume import FACE_NAMES

from ..errors import InputError
from ..figures.evaluate import FACE_COLORS, face_labels
from ..options import PROBLEMS, ElasticityOptions, PoissonOptions, ProblemOptions

UNIT = ("unit", "Unit of lengths, such as mm", "none")  # of every problem


@dataclass(frozen=True)
class Sheet:
    """Hold the form of one problem on the page.

    title: name of the problem. equation: text above the fields. fields: of each field the option, its label, and the
    value of an empty field. lists: the same of options with data on regions of the part, an entry a line, and the text
    behind a region that was clicked. signs: symbols of options in a line of text.
    """

    title: str
    equation: str
    fields: tuple[tuple[str, str, str], ...]
    lists: tuple[tuple[str, str, str, str], ...]
    signs: Mapping[str, str]


SHEETS = {
    "poisson": Sheet(
        "Poisson's equation",
        "−div(κ grad u) + c u = f. Formulas use x, y, z, in the surface's units, or X, Y, Z, scaled to volume 1.",
        (
            ("kappa", "Coefficient κ, one formula or six: xx,xy,xz,yy,yz,zz", "1"),
            ("reaction", "Reaction c", "0"),
            ("exact", "Exact solution u, from which empty data follow", "none; without a source exp(X+Z)*sin(Y)"),
            ("source", "Source f", "that of the exact solution"),
            ("boundary", "Values of u on the faces", "those of the exact solution, or 0"),
        ),
        (
            ("value", "Values of u on regions", "REGION=FORMULA, one a line", "="),
            ("flux", "Flux κ du/dn on regions", "REGION=FORMULA, one a line", "="),
            ("exchange", "Exchange κ du/dn = α (outside − u) on regions", "REGION=ALPHA:OUTSIDE, one a line", "="),
        ),
        {"kappa": "κ", "reaction": "c", "exact": "u", "source": "f", "boundary": "u on the faces"},
    ),
    "elasticity": Sheet(
        "an elastic body",
        "−div σ = f, small displacements. Click a face of the part for its region; the rest of its boundary is free.",
        (
            ("young", "Young's modulus E", "1"),
            ("poisson_ratio", "Poisson's ratio ν", "0.3"),
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        (
            ("fix", "Held regions, or with a given displacement", "REGION or REGION=0;0;0.1, one a line", ""),
            ("roller", "Regions held along their normal alone", "REGION, one a line", ""),
            ("load", "Force per area on regions", "REGION=0;0;-1, one a line", "=0;0;0"),
            ("pressure", "Pressure on regions, against the outward normal", "REGION=FORMULA, one a line", "="),
            ("spring", "Elastic foundation, force per area and displacement", "REGION=FORMULA, one a line", "="),
        ),
        {"young": "E", "poisson_ratio": "ν", "body_force": "f"},
    ),
}
LOADS = ("body_force", "fix", "load", "pressure")  # without one of these loads an elastic body does not move
EXCHANGE = "exchange"  # the other kind of data of a face of the cube is "flux"


def described() -> dict[str, Any]:
    """Return the content of the form: problems with fields and lists, common fields, and the faces of the cube."""
    sheets = [
        {
            "name": name,
            "title": sheet.title,
            "equation": sheet.equation,
            "fields": [_named(field) for field in sheet.fields],
            "lists": [_named(field) for field in sheet.lists],
        }
        for name, sheet in SHEETS.items()
    ]
    faces = zip(FACE_NAMES, face_labels(), FACE_COLORS, strict=True)
    return {
        "problems": sheets,
        "common": [_named(UNIT)],
        "faces": [{"name": name, "label": label, "color": color} for name, label, color in faces],
    }


def _named(field: tuple[str, ...]) -> dict[str, str]:
    return dict(zip(("name", "title", "empty", "after"), field, strict=False))


def stated(form: Mapping[str, Any], statement: ProblemOptions, *, has_faces: bool = True) -> ProblemOptions:
    """Return the options of the problem that a form states; its empty fields are left out.

    form: `problem`, a name of SHEETS, with its fields and lists; of Poisson's equation, where it has the cube's faces,
    for a face u0 that has data of its own `face u0`, with `kind u0` ("flux" or "exchange"), `alpha u0` and `data u0`.
    statement: the problem of the page's options, which has the values that the form does not ask for. Raises InputError
    for data that the solver refuses.
    """
    name = _text(form, "problem") or "poisson"
    if name not in SHEETS:
        raise InputError(f"problem {name!r:.80}: choose one of {', '.join(SHEETS)}")
    sheet = SHEETS[name]
    given: dict[str, Any] = {field: _text(form, field) or None for field, _, _ in (*sheet.fields, UNIT)}
    for field, *_ in sheet.lists:
        given[field] = tuple(filter(None, map(str.strip, _text(form, field).splitlines())))
    if name == "elasticity":
        if not any(given[field] for field in LOADS):
            raise InputError("nothing acts on the body: give a load, a pressure, a force or a displacement")
        for field in ("young", "poisson_ratio"):
            given[field] = _number(sheet, field, given[field])
    elif has_faces:
        given["neumann"], given["robin"] = _of_faces(form)
    found = replace(_base(name, statement), **given)
    found.problem()
    return found


def _text(form: Mapping[str, Any], name: str) -> str:
    return str(form.get(name, "")).strip()


def _base(name: str, statement: ProblemOptions) -> ProblemOptions:
    """Return options of that problem: those given, or new ones with its meshes, degree and quadrature."""
    if statement.section == name:
        return statement
    shared = {field.name: getattr(statement, field.name) for field in fields(ProblemOptions) if field.name != "exact"}
    return PROBLEMS[name](**shared)


def _number(sheet: Sheet, name: str, text: str | None) -> float:
    """Return the number that a field has, or that holds where it is empty. Raises InputError."""
    title, empty = next((title, empty) for field, title, empty in sheet.fields if field == name)
    try:
        return float(text or empty)
    except ValueError:
        raise InputError(f"{title}: give a number, such as {empty}, got {text!r:.80}") from None


def _of_faces(form: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the flux and the exchange that are given on faces of the cube. Raises InputError."""
    neumann, robin = [], []
    for face in FACE_NAMES:
        if not _text(form, f"face {face}"):
            continue
        data = _text(form, f"data {face}")
        if _text(form, f"kind {face}") != EXCHANGE:
            neumann.append(f"{face}={data}" if data else face)
        elif alpha := _text(form, f"alpha {face}"):
            robin.append(f"{face}={alpha}:{data}" if data else f"{face}={alpha}")
        else:
            raise InputError(f"face {face}: give α, the coefficient of the exchange")
    return tuple(neumann), tuple(robin)


def filled(statement: ProblemOptions) -> dict[str, str]:
    """Return the form that states these options, as `stated` reads it; options that are not given are left out."""
    sheet, form = SHEETS[statement.section], {"problem": statement.section}
    known = ((name, getattr(statement, name)) for name, _, _ in (*sheet.fields, UNIT))
    form |= {name: f"{value:.12g}" if isinstance(value, float) else value for name, value in known if value}
    form |= {name: "\n".join(lines) for name, *_ in sheet.lists if (lines := getattr(statement, name))}
    if not isinstance(statement, PoissonOptions):
        return form
    problem = statement.problem()
    for face, data in problem.neumann.items():
        form |= {f"face {face}": "on", f"kind {face}": "flux", f"data {face}": str(data or "")}
    for face, (alpha, data) in problem.robin.items():
        form |= {f"face {face}": "on", f"kind {face}": EXCHANGE, f"alpha {face}": str(alpha)}
        form |= {f"data {face}": str(data or "")}
    return form


def in_words(statement: ProblemOptions) -> str:
    """Return the data of a problem in one line, which distinguishes jobs."""
    sheet, form = SHEETS[statement.section], filled(statement)
    said = [sheet.title] if isinstance(statement, ElasticityOptions) else []
    said += [f"{sign} = {form[name]}" for name, sign in sheet.signs.items() if name in form]
    for face in FACE_NAMES:
        if kind := form.get(f"kind {face}"):
            data = form[f"data {face}"]
            said.append(f"{kind} on {face}" + f": {data}" * bool(data))
    said += [f"{name} on {', '.join(getattr(statement, name))}" for name, *_ in sheet.lists if name in form]
    return ", ".join(said) or "the problem of an empty form"
