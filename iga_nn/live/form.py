"""Reads the form in which the live page asks for the data of Poisson's equation."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from parameterize.spline.volume import FACE_NAMES

from ..errors import InputError
from ..figures.evaluate import FACE_COLORS, face_labels
from ..options import PoissonOptions

FIELDS = (  # of PoissonOptions, what each is called on the page, and what holds where it is left empty
    ("kappa", "Coefficient κ, one formula or six: xx,xy,xz,yy,yz,zz", "1"),
    ("reaction", "Reaction c", "0"),
    ("exact", "Exact solution u, from which all that is left empty follows", "none; without a source exp(X+Z)*sin(Y)"),
    ("source", "Source f", "that of the exact solution"),
    ("boundary", "Values of u on the faces", "those of the exact solution, or 0"),
)
SIGNS = {"kappa": "κ", "reaction": "c", "exact": "u", "source": "f", "boundary": "u on the faces"}
LISTS = (  # the same of options that hold data on regions of the part, an entry a line, where the problem has them
    ("value", "Values of u on regions", "REGION=FORMULA, one a line"),
    ("flux", "Flux κ du/dn on regions", "REGION=FORMULA, one a line"),
    ("exchange", "Exchange κ du/dn + α u = g on regions", "REGION=ALPHA:FORMULA, one a line"),
)
EXCHANGE = "exchange"  # the other kind of data of a face is "flux"


def lists_of(options: PoissonOptions) -> list[tuple[str, str, str]]:
    """Return those of LISTS that the options have."""
    known = {field.name for field in fields(options)}
    return [field for field in LISTS if field[0] in known]


def described(options: PoissonOptions) -> dict[str, Any]:
    """Return what the page lists: the fields, the lists of regions, and the faces with their colours."""
    faces = zip(FACE_NAMES, face_labels(), FACE_COLORS, strict=True)
    return {
        "fields": [dict(zip(("name", "title", "empty"), field, strict=True)) for field in FIELDS],
        "lists": [dict(zip(("name", "title", "empty"), field, strict=True)) for field in lists_of(options)],
        "faces": [{"name": name, "label": label, "color": color} for name, label, color in faces],
    }


def stated(form: Mapping[str, Any], options: PoissonOptions, *, has_faces: bool = True) -> PoissonOptions:
    """Return the options with the data that a form states; its empty fields are left out.

    form: the fields of FIELDS and LISTS; where it has the cube's faces, for a face u0 that has data of its own
    `face u0`, with `kind u0` ("flux" or "exchange"), `alpha u0` and `data u0`. Raises InputError for data that cannot
    be solved with.
    """

    def text(name: str) -> str:
        return str(form.get(name, "")).strip()

    neumann, robin = [], []
    for face in FACE_NAMES:
        if not text(f"face {face}"):
            continue
        data = text(f"data {face}")
        if text(f"kind {face}") != EXCHANGE:
            neumann.append(f"{face}={data}" if data else face)
        elif alpha := text(f"alpha {face}"):
            robin.append(f"{face}={alpha}:{data}" if data else f"{face}={alpha}")
        else:
            raise InputError(f"face {face}: give α, the coefficient of the exchange")
    given: dict[str, Any] = {name: text(name) or None for name, _, _ in FIELDS}
    given |= {name: tuple(filter(None, map(str.strip, text(name).splitlines()))) for name, _, _ in lists_of(options)}
    if has_faces:
        given |= {"neumann": tuple(neumann), "robin": tuple(robin)}
    found = replace(options, **given)
    found.problem()
    return found


def filled(options: PoissonOptions) -> dict[str, str]:
    """Return the form that states these options, as `stated` reads it; what is not given is left out."""
    form = {name: value for name, _, _ in FIELDS if (value := getattr(options, name))}
    form |= {name: "\n".join(lines) for name, _, _ in lists_of(options) if (lines := getattr(options, name))}
    problem = options.problem()
    for face, data in problem.neumann.items():
        form |= {f"face {face}": "on", f"kind {face}": "flux", f"data {face}": str(data or "")}
    for face, (alpha, data) in problem.robin.items():
        form |= {f"face {face}": "on", f"kind {face}": EXCHANGE, f"alpha {face}": str(alpha)}
        form |= {f"data {face}": str(data or "")}
    return form


def in_words(options: PoissonOptions) -> str:
    """Return the data of a problem in one line, by which jobs are told apart."""
    form = filled(options)
    said = [f"{sign} = {form[name]}" for name, sign in SIGNS.items() if name in form]
    for face in FACE_NAMES:
        if kind := form.get(f"kind {face}"):
            data = form[f"data {face}"]
            said.append(f"{kind} on {face}" + f": {data}" * bool(data))
    said += [f"{name} on {', '.join(getattr(options, name))}" for name, _, _ in lists_of(options) if name in form]
    return ", ".join(said) or "the problem of an empty form"
