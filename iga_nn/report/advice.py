"""Advises on a map that is not certified: the places without a proof, and the remedies."""

from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray, in_brackets, listed
from parameterize.certificate.certify import Certificate
from parameterize.certificate.jacobian import PatchCertificate
from parameterize.config import MAX_CONTROL_POINTS
from parameterize.spline.body import Body
from parameterize.spline.bspline import midpoints
from parameterize.spline.volume import BSplineVolume

from ..options import MapOptions
from .document import Report, is_certified, not_the_part

SHOWN = 5  # places
THIN = 1 / 20  # of the box's longest side: one cube is squeezed there
HEXAHEDRA = ("hexahedra", "last hexahedra")  # names of ways
SOLID_MODELS = (".step", ".stp", ".iges", ".igs", ".brep")


def span_parameters(volume: BSplineVolume, spans: IntArray) -> Array:
    """Return the midpoints (k, 3), in the cube, of knot spans with the numbers (k, 3)."""
    return np.stack([midpoints(knots)[spans[:, axis]] for axis, knots in enumerate(volume.knots)], axis=1)


def span_places(volume: BSplineVolume, spans: IntArray) -> Array:
    """Return the images (k, 3) of the midpoints of spans (k, 3), in the volume's units."""
    return volume(span_parameters(volume, spans)) if len(spans) else np.empty((0, 3))


def unproved(volume: BSplineVolume, certificate: PatchCertificate) -> dict[str, Any]:
    """Return an entry of the section `parameterization`: the number of spans without a proof, and some of their places.

    The first place is the worst fold found, where there is one; `flat` a point where det J is zero.
    """
    spans = certificate.unproved
    if not len(spans):
        return {}
    picked = spans[np.unique(np.linspace(0, len(spans) - 1, SHOWN).round().astype(int))]
    parameters = span_parameters(volume, picked)
    if certificate.witness is not None:
        parameters = np.concatenate([[certificate.witness], parameters])[:SHOWN]
    found = {"spans": len(spans), "parameters": parameters.tolist(), "places": volume(parameters).tolist()}
    if certificate.flat is not None:
        found["flat"] = volume(certificate.flat)[0].tolist()
    return {"unproved": found}


def with_unproved(section: Report, body: Body, certificate: Certificate) -> Report:
    """Return a section with the places without a proof: of a volume, or of each patch under `patches` and in all."""
    if body.is_single:
        return section | unproved(body.only, certificate.only)
    parts = zip(section["patches"], body, certificate.patches, strict=True)
    each = [known | unproved(patch, own) for known, patch, own in parts]
    return section | {"patches": each} | _in_all(each)


def _in_all(each: list[Report]) -> dict[str, Any]:
    """Return the number of spans without a proof on all patches, and a place of each patch that has some."""
    found = [own["unproved"] for own in each if "unproved" in own]
    if not found:
        return {}
    return {"unproved": {"spans": sum(own["spans"] for own in found), "places": [own["places"][0] for own in found]}}


def unproved_places(body: Body, certificate: Certificate) -> Array:
    """Return the images (k, 3) of the midpoints of all spans without a proof, in the body's units."""
    parts = zip(body, certificate.patches, strict=True)
    return np.concatenate([span_places(patch, own.unproved) for patch, own in parts])


def what_to_try(report: Report, mapping: MapOptions | None = None) -> list[str]:
    """Return remedies for a map that is not certified or not the part, the most promising first; else an empty list.

    Where the reason is known they are those for this reason. mapping: the options of the map, where they are known.
    """
    if is_certified(report) and not not_the_part(report):
        return []
    if "cut_map" in report:
        return ["more time: --resume goes on, with a longer --time-limit or none"]
    known = [*_of_the_surface(report), *_of_the_ways(report, mapping)]
    return known or _in_general(report, mapping)


def _in_general(report: Report, mapping: MapOptions | None) -> list[str]:
    """Return remedies where no reason is known."""
    quality, remedies = report["parameterization"], list[str]()
    if "patches" in quality:  # several patches; those of a file have no options
        kind = "max-" if mapping is not None and mapping.control_points == "auto" else ""
        return [] if mapping is None else _more_control_points(mapping.most_control_points, kind)
    if mapping is not None and mapping.steps_factor < 1.0:
        remedies.append("the whole training: leave out --steps-factor")
    is_limit = quality.get("refinement", {}).get("stopped") == "limit reached"
    remedies += _more_control_points(max(quality["control_points"]), "max-" * is_limit)
    if not is_certified(report):  # there are places
        is_first = mapping is None or mapping.corners is None
        corners = "your own corners," if is_first else "other corners, farther apart and"
        remedies.append(f"{corners} away from those places: --corners FILE")
    remedies.append(f"another seed: --seed {mapping.seed + 1 if mapping else 1}")
    return remedies


def _of_the_surface(report: Report) -> list[str]:
    """Return remedies that another surface is."""
    remedies = []
    if crossing := report.get("input", {}).get("self_intersections", {}).get("pairs", 0):
        remedies.append(f"a surface that does not intersect itself: {crossing} pairs of its faces do (`iga-nn check`)")
    if report["parameterization"].get("boundary_meeting") and report["parameterization"]["bijective"] == "certified":
        remedies.append("a surface whose parts are farther apart there, or more faces around that gap")
    return remedies


def _of_the_ways(report: Report, mapping: MapOptions | None) -> list[str]:
    """Return the remedy of hexahedra, which serve every part with sharp edges, where they were not tried."""
    quality, given = report["parameterization"], report.get("input", {})
    tried = {attempt["origin"] for attempt in quality.get("attempts", ())}
    if mapping is None or "hexahedra" in tried or not tried:
        return []
    why = _in_proportion(given)
    refused = quality.get("refused", {})
    if reason := next((refused[name] for name in HEXAHEDRA if name in refused), ""):
        return [f"{why}hexahedra could not be made ({reason}): repair the surface there, or give a STEP file"]
    is_solid = Path(str(given.get("file", ""))).suffix.lower() in SOLID_MODELS
    if not is_solid and given.get("sharp_edges", {}).get("length", 0.0) <= 0.0:
        return []
    if mapping.ways and not {name.replace("-", " ") for name in mapping.ways} & set(HEXAHEDRA):
        return [f"{why}hexahedra, which serve every part: leave out --ways, or add hexahedra to it"]
    if mapping.blocks != "auto":
        return [f"{why}hexahedra, which serve every part: leave out --blocks"]
    if mapping.corners is not None:
        return [f"{why}hexahedra, which serve every part: leave out --corners"]
    return []


def _in_proportion(given: Report) -> str:
    """Return in words how thin a part is, such as "a part of 1 mm in 60: "; "" for one that is not thin."""
    if not (thickness := given.get("thickness")) or "bbox" not in given:
        return ""
    low, high = np.array(given["bbox"])
    size = float((high - low).max())
    unit = f" {given['unit']}" if given.get("unit") else ""
    return f"a part of {thickness:.2g}{unit} in {size:.3g}: " if thickness < THIN * size else ""


def _more_control_points(known: int, kind: str = "") -> list[str]:
    """Return the remedy of more control points a direction than the known number, where there may be more."""
    more = min(known + 10, MAX_CONTROL_POINTS)
    return [f"more control points: --{kind}control-points {more}"] if more > known else []


def in_words(report: Report) -> list[str]:
    """Return the places and the remedies, one a line; an empty list for a certified map."""
    quality, lines = report["parameterization"], []
    if found := quality.get("unproved"):
        places = listed(list(map(in_brackets, found["places"])), SHOWN)
        flat = f"; det J is zero, up to rounding, at {in_brackets(found['flat'])}" if "flat" in found else ""
        lines.append(f"not proved       on {found['spans']} spans, near {places}{flat}")
    if quality.get("overlap"):
        lines.append("overlaps         parts of the body lie in each other")
    if misglued := quality.get("misglued"):
        lines.append(f"folded back      at {listed(misglued)}")
    if meeting := quality.get("boundary_meeting"):
        lines.append(f"meets itself     at {in_brackets(meeting['point'])}")
    return lines + [f"try              {remedy}" for remedy in report.get("advice", [])]
