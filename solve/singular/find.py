"""Finds the singular places of a problem: edges with an infinite gradient, and rims of held regions inside faces."""

from collections.abc import Sequence

import numpy as np

from parameterize.arrays import Knots
from parameterize.spline.body import Body

from ..forms.boundary_value_problem import BoundaryValueProblem
from .held import Supports
from .judged_edges import DIFFER, JudgedEdges
from .pieces import SingularPieces, of_rim
from .places import SingularPlace, SingularPlaces
from .rims import HeldRim, rims_in_faces
from .spans import SpanLengths


def singular_places(body: Body, problems: Sequence[BoundaryValueProblem], knots: Sequence[Knots]) -> SingularPlaces:
    """Return the singular places of a problem.

    problems: those of the patches, placed in the body. knots: those of each patch's trial space, whose spans say how
    far a place reaches. Exponents are those of isotropic laws with a symmetric part alone. Edges inside the body at
    which three solids meet, edges inside a patch with knots as many as its degree, and corners are not looked at.
    """
    supports, spans = Supports(body, problems), SpanLengths.of(knots)
    found = list(SingularPieces(JudgedEdges(body, problems, supports, spans)).places())
    if supports.conditions and not supports.is_of_faces:
        found = _with_rims(found, rims_in_faces(body, supports, spans.inner, DIFFER), supports)
    return SingularPlaces(tuple(found))


def _with_rims(found: list[SingularPlace], rims: HeldRim, supports: Supports) -> list[SingularPlace]:
    """Return the places together with the rims inside faces: those of one condition are one place."""
    for name in np.unique(rims.names).tolist():
        own, text = rims.names == name, of_rim(supports, name)
        parts = [SingularPlace("rim", text, rims.points[own], rims.spans[own], 0.5)]
        parts += [place for place in found if place.text == text]
        found = [place for place in found if place.text != text]
        points, sizes = (np.concatenate([getattr(part, key) for part in parts]) for key in ("points", "spans"))
        found.insert(0, SingularPlace("rim", text, points, sizes, min(part.exponent for part in parts)))
    return found
