"""Reads the live page's form of a problem: Poisson's equation, or an elastic body."""

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from parameterize.spline.volume import FACE_NAMES

from ..errors import InputError
from ..figures.colors import FACE_COLORS, face_labels
from ..options import PROBLEMS, PoissonOptions, ProblemOptions
from ..options.materials import Unstated

_OPTION = re.compile(r"^ {8}(\w+): (.*(?:\n {12}.*)*)", re.MULTILINE)  # of the docstring of options
UNIT = ("unit", "Unit of lengths, such as mm", "none")  # of every problem, as ASK
ASK = ("ask", "Quantities to answer with intervals", "von_mises max over REGION, or uz at (1, 0, 0), one a line")
USUAL = ("fix", "load", "pressure", "total_force", "value", "flux", "exchange")  # lists that are seen at first
OF_FACE = {
    "poisson": ("flow over", "mean u over"),
    "elasticity": ("von_mises max over", "reaction z of"),
}  # asks of a face


EXCHANGE = "exchange"  # the other kind of data of a face of the cube is "flux"


def described() -> dict[str, Any]:
    """Return the content of the form: problems with fields and lists, common fields, and the faces of the cube."""
    sheets = [
        {
            "name": name,
            "title": kind.sheet.title,
            "equation": kind.sheet.equation,
            "fields": [_named(field) for field in kind.sheet.fields],
            "lists": [field for field in lists_of(kind) if field["name"] in USUAL],
            "more": [field for field in lists_of(kind) if field["name"] not in USUAL],
            "asks": OF_FACE.get(name, ()),
        }
        for name, kind in PROBLEMS.items()
    ]
    faces = zip(FACE_NAMES, face_labels(), FACE_COLORS, strict=True)
    return {
        "problems": sheets,
        "common": [_named(UNIT)],
        "ask": _named(ASK),
        "faces": [{"name": name, "label": label, "color": color} for name, label, color in faces],
    }


def lists_of(kind: type[ProblemOptions]) -> list[dict[str, str]]:
    """Return the lists of regions with data of a problem's form."""
    return [_named(field) | {"short": field[0].replace("_", " ")} for field in _lists(kind)]


def _named(field: tuple[str, ...]) -> dict[str, str]:
    return dict(zip(("name", "title", "empty", "after"), field, strict=False))


def _lists(kind: type[ProblemOptions]) -> list[tuple[str, str, str, str]]:
    """Return the options with data on regions: each with its label and form of an entry, and the end of a first entry.

    They follow from the line of the option: "regions with a force per area, each as "REGION=VECTOR"".
    """
    found, docs = [], "\n".join(base.__doc__ or "" for base in kind.__mro__)
    said = dict(_OPTION.findall(docs))
    for name in kind.on_regions():
        words = " ".join(said[name].split())
        forms = list(dict.fromkeys(re.findall(r"REGION(?:=[A-Z:]+(?: at POINT)?)?", words))) or ["REGION"]
        after = "" if "REGION" in forms else "=0;0;0" if "VECTOR" in forms[0] else "="
        after += " at (0, 0, 0)" * ("POINT" in forms[0])
        label = re.split(r", each as|[;.]", words)[0]
        found.append((name, label[0].upper() + label[1:], f"{' or '.join(forms)}, one a line", after))
    return found


def stated(form: Mapping[str, Any], problem_options: ProblemOptions, *, has_faces: bool = True) -> ProblemOptions:
    """Return the options of the problem that a form states; its empty fields are left out.

    form: `problem`, a name of PROBLEMS, with its fields and lists; of Poisson's equation, if it has the cube's faces,
    for a face u0 that has data of its own `face u0`, with `kind u0` ("flux" or "exchange"), `alpha u0` and `data u0`.
    problem_options: the problem of the page's options, which has the values that the form does not ask for. Raises
    InputError for data that the solver refuses.
    """
    name = _text(form, "problem") or "poisson"
    if name not in PROBLEMS:
        raise InputError(f"problem {name!r:.80}: choose one of {', '.join(PROBLEMS)}")
    kind = PROBLEMS[name]
    given: dict[str, Any] = {}
    for field, title, empty in (*kind.sheet.fields, UNIT):
        given[field] = _text(form, field) or None
        if isinstance(getattr(kind, field), float):
            given[field] = _number(title, empty, text) if (text := given[field]) else getattr(kind, field)
    for field in (*kind.on_regions(), ASK[0]):
        given[field] = tuple(filter(None, map(str.strip, _text(form, field).splitlines())))
    if has_faces and "robin" in kind.on_faces:
        given["neumann"], given["robin"] = _of_faces(form)
    found = replace(_base(name, problem_options), **given)
    found.problem()
    return found


def _text(form: Mapping[str, Any], name: str) -> str:
    return str(form.get(name, "")).strip()


def _base(name: str, problem_options: ProblemOptions) -> ProblemOptions:
    """Return options of that problem: those given, or new ones with its meshes, degree and quadrature."""
    if problem_options.section == name:
        return problem_options
    shared = {
        field.name: getattr(problem_options, field.name) for field in fields(ProblemOptions) if field.name != "exact"
    }
    return PROBLEMS[name](**shared)


def _number(title: str, empty: str, text: str) -> float:
    """Return the number that a field has. Raises InputError."""
    try:
        return float(text)
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


def filled(problem_options: ProblemOptions) -> dict[str, str]:
    """Return the form that states these options, as `stated` reads it; options that are not given are left out."""
    form = {"problem": problem_options.section}
    known = ((name, getattr(problem_options, name)) for name, _, _ in (*problem_options.sheet.fields, UNIT))
    form |= {
        name: f"{value:.12g}" if isinstance(value, float) else value
        for name, value in known
        if value and not isinstance(value, Unstated)
    }
    form |= {
        name: "\n".join(lines)
        for name in (*problem_options.on_regions(), ASK[0])
        if (lines := getattr(problem_options, name))
    }
    if not isinstance(problem_options, PoissonOptions):
        return form
    problem = problem_options.problem()
    for face, data in problem.neumann.items():
        form |= {f"face {face}": "on", f"kind {face}": "flux", f"data {face}": str(data or "")}
    for face, (alpha, data) in problem.robin.items():
        form |= {f"face {face}": "on", f"kind {face}": EXCHANGE, f"alpha {face}": str(alpha)}
        form |= {f"data {face}": str(data or "")}
    return form


def in_words(problem_options: ProblemOptions) -> str:
    """Return the data of a problem in one line, which distinguishes jobs."""
    form, sheet = filled(problem_options), problem_options.sheet
    if not form.get("material"):
        values = ((name, getattr(problem_options, name)) for name in sheet.signs)
        form |= {name: f"{value:g}" for name, value in values if isinstance(value, Unstated)}
    said = [] if problem_options.section == "poisson" else [sheet.title]
    said += [f"{sign} = {form[name]}" for name, sign in sheet.signs.items() if name in form]
    for face in FACE_NAMES:
        if kind := form.get(f"kind {face}"):
            data = form[f"data {face}"]
            said.append(f"{kind} on {face}" + f": {data}" * bool(data))
    said += [
        f"{name.replace('_', ' ')} on {', '.join(getattr(problem_options, name))}"
        for name in problem_options.on_regions()
        if name in form
    ]
    return ", ".join(said) or "the problem of an empty form"
