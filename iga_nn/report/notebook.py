"""Shows a result in a notebook: its facts as a table, without pictures."""

import heapq
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from functools import singledispatch
from typing import Any

from parameterize.arrays import Array, in_brackets
from parameterize.certificate.certify import Certificate
from parameterize.certificate.jacobian import PatchCertificate
from parameterize.quality.distortion import BoxDistortion
from parameterize.quality.quality import BothScales, QualityReport
from parameterize.spline.body import Body, all_control_points
from parameterize.spline.bspline import breakpoints
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.surface import Surface
from solve.solution import Solution
from solve.study import Convergence

from ..level_table import as_rows
from ..rounding import distortion
from . import asked
from . import document as reports
from .html import filled


@singledispatch
def as_html(result: object) -> str:
    """Return the table of a surface, volume, body, certificate, quality, solution or convergence study as HTML."""
    raise TypeError(f"there is no table of a {type(result).__name__}")


@as_html.register
def _surface(surface: Surface) -> str:
    facts = [
        ("vertices", f"{len(surface.vertices):,}"),
        ("faces", f"{len(surface.faces):,}"),
        ("volume", f"{surface.volume:.6g}"),
        ("from, to", _ends(*surface.bbox)),
        *(("notice", line) for line in surface.notices),
    ]
    return _table(f"Surface {surface.name}, accepted", facts)


@as_html.register
def _volume(volume: BSplineVolume) -> str:
    net = volume.control_points.reshape(-1, 3)
    facts = [
        ("control points", _times(volume.shape)),
        ("degrees", ", ".join(map(str, volume.degrees))),
        ("knot spans", _times([len(breakpoints(row)) - 1 for row in volume.knots])),
        *([] if volume.weights is None else [("weights", f"{volume.weights.min():.6g} to {volume.weights.max():.6g}")]),
        ("lies within", _ends(net.min(axis=0), net.max(axis=0))),
    ]
    return _table("Spline volume", facts)


@as_html.register
def _body(body: Body) -> str:
    net = all_control_points(body)
    facts = [
        ("patches", str(len(body))),
        *([] if body.solids.is_plain else [("solids", body.solids.told)]),
        ("interfaces", str(len(body.interfaces))),
        ("outer faces", str(sum(map(len, body.outer)))),
        ("control points", f"{body.numbering[1]:,}"),
        ("lies within", _ends(net.min(axis=0), net.max(axis=0))),
    ]
    return _table("Body of several patches", facts)


@as_html.register
def _certificate(certificate: Certificate) -> str:
    if len(certificate.patches) == 1 and not certificate.misglued:
        return _of_patch(certificate.only)
    facts = [("volume", f"{certificate.volume:.6g}")]
    if certificate.verdict == "certified":
        facts.append(("|det J| is at least", f"{certificate.lower_bound:.3g} of its mean"))
    return _table(
        f"{len(certificate.patches)} patches: {certificate.verdict}", facts, notices=certificate.first_defects
    )


def _of_patch(certificate: PatchCertificate) -> str:
    facts = [("volume", f"{certificate.mean_det:.6g}")]
    if certificate.verdict == "certified":
        facts.append(("det J is at least", f"{certificate.lower_bound:.3g} of its mean"))
    if certificate.left_handed:
        facts.append(("u, v, w", certificate.orientation))
    if len(certificate.unproved):
        facts.append(("not proved", f"on {len(certificate.unproved)} knot spans"))
    if certificate.witness is not None:
        facts.append(("folded at u, v, w", in_brackets(certificate.witness)))
    return _table(f"{certificate.claim}: {certificate.verdict}", facts)


@as_html.register
def _quality(quality: QualityReport) -> str:
    report = {"parameterization": quality.as_dict()}
    rows = [
        ("ARAP distortion: mean, max", *_both(quality.arap, distortion)),
        ("boundary at the mesh's vertices: rms, mean, max", *_both(quality.boundary)),
        ("mesh to spline: rms, mean, max", *_both(quality.mesh_to_spline)),
        ("spline to mesh: rms, mean, max", *_both(quality.spline_to_mesh)),
        ("both ways: rms, mean, max", *_both(quality.surface_distance)),
    ]
    title = f"{reports.claim(report)}: {quality.certificate.verdict}; one-to-one: {reports.one_to_one(report)}"
    return _table(title, rows, head=("", "at volume 1", "as given")) + _patches(quality.patches)


def _patches(patches: Sequence[BoxDistortion]) -> str:
    """Return the table of several patches, each measured against its own box; "" for none."""
    rows = [
        (
            f"p{i}",
            _times([f"{side:.3g}" for side in one.box]),
            distortion(one.arap.mean),
            distortion(one.arap.max),
            f"{one.scaled_jacobian:.3g}",
        )
        for i, one in _shown(patches)
    ]
    head = ("", "own box", "ARAP, mean", "ARAP, max", "least scaled det J")
    title = "Patches, as given" if len(rows) == len(patches) else f"The most distorted of {len(patches):,} patches"
    return _table(title, rows, head) if rows else ""


def _shown(patches: Sequence[BoxDistortion]) -> list[tuple[int, BoxDistortion]]:
    """Return patches with their numbers, of many the most distorted."""
    numbered = list(enumerate(patches))
    few = len(numbered) <= reports.MOST_ROWS
    return numbered if few else heapq.nlargest(reports.WORST, numbered, key=lambda pair: pair[1].arap.max)


@as_html.register
def _solution(solution: Solution) -> str:
    report = solution.report
    head, *rows = as_rows([report.as_dict()])
    title = "Solution" if report.converged else f"Solution, NOT CONVERGED (residual {report.residual:.1e})"
    answers = [answer.as_dict() for answer in solution.answers]
    found = _table("Asked quantities", asked.rows({"asked": answers}), asked.HEAD) if answers else ""
    return found + _table(title, rows, head, notices=report.notices)


@as_html.register
def _study(study: Convergence) -> str:
    levels = [row.report.as_dict() | {"rate_l2": row.rate_l2, "rate_h1": row.rate_h1} for row in study]
    head, *rows = as_rows(levels) or [[]]
    notices = dict.fromkeys(line for row in study for line in row.report.notices)
    return _table("Convergence", rows, head, notices=notices)


def _both(measure: BothScales[Any], shown: Callable[[float], str] = "{:.4g}".format) -> list[str]:
    return [", ".join(map(shown, asdict(m).values())) for m in (measure.unit_volume, measure.as_given)]


def _times(counts: Sequence[object]) -> str:
    return " × ".join(map(str, counts))


def _ends(low: Array, high: Array) -> str:
    return f"{in_brackets(low)} to {in_brackets(high)}"


def _table(title: str, rows: Iterable[Sequence[str]], head: Sequence[str] = (), *, notices: Iterable[str] = ()) -> str:
    """Return a table as HTML, with a list of notices below."""
    return filled("report/notebook.html", title=title, rows=rows, head=head, notices=list(notices))
