"""Adds the places without a proof to the section `parameterization`, and makes the table of several patches from it."""

from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.certificate.body import Certificate
from parameterize.spline.body import Body

from .advice import span_places, unproved
from .document import Report, size_in_words


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


def table(section: Report) -> list[list[str]]:
    """Return the table of several patches: the titles of what is known, then a row a patch; no row for a volume."""
    rows = [{"patch": f"p{number}", **_row(patch)} for number, patch in enumerate(section.get("patches", ()))]
    return [list(rows[0]), *(list(row.values()) for row in rows)] if rows else []


def _row(patch: Report) -> dict[str, str]:
    """Return what is proved of a patch and, where it was measured against its own box, how much it distorts this."""
    bound = patch["det_lower_bound"]
    proof = "–" if patch["bijective"] != "certified" or bound is None else f"≥ {bound:.3g} of its mean"
    found = {"control points": size_in_words(patch), "det J": patch["bijective"], "|det J|": proof}
    if "own_box" not in patch:
        return found
    return found | {
        "own box": " × ".join(f"{side:.3g}" for side in patch["own_box"]),
        "ARAP, mean": f"{patch['arap']['mean']:.3g}",
        "largest": f"{patch['arap']['max']:.3g}",
        "least scaled det J": f"{patch['scaled_jacobian']:.3g}",
    }
