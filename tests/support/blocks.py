"""Bodies of several patches as `parameterize` returns them, with the surface that their sampled outer faces give."""

import numpy as np

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.config import preset
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.quality.quality import measure
from parameterize.run import Parameterization
from parameterize.spline.orientation import orientation
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.ways.tried import AttemptReport

DIGITS = 9  # of coordinates by which samples of two faces are one vertex


def outer_surface(body, samples=5):
    """The sampled outer faces as one closed surface: BoundaryMap with each vertex on one of its patches."""
    found = SampledBoundary.of(body, samples)
    _, first, number = np.unique(np.round(found.points, DIGITS) + 0.0, axis=0, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[found.triangles]
    hands = np.array([orientation(patch) for patch in body])[found.patches[found.triangles[:, 0]]]
    faces[hands < 0] = faces[hands < 0, ::-1]
    return BoundaryMap(found.points[first], found.parameters[first], faces, patches=found.patches[first])


def mapped_to(body, surface, seed=0):
    """The result of a map of this surface, whose vertices are samples of the body's outer faces, in any order."""
    outer = outer_surface(body)
    place = {tuple(row): k for k, row in enumerate(np.round(outer.vertices, DIGITS).tolist())}
    rows = [place[tuple(row)] for row in np.round(surface.vertices, DIGITS).tolist()]
    where = outer.parameters[rows], surface.faces, surface.faces, surface.groups, outer.patches[rows]
    boundary = BoundaryMap(surface.vertices, *where)
    proofs = certify(body), check_boundary(body)
    return Parameterization(
        volume=body,
        boundary=boundary,
        certificate=proofs[0],
        quality=measure(body, surface.vertices, surface.faces, surface.scale, boundary, *proofs),
        history={
            "stage": np.array(["spline"]),
            "step": np.array([0]),
            "loss": np.array([0.1]),
            "folded": np.array([0]),
        },
        seconds={"optimize": 0.5, "certify": 0.1},
        device="cpu",
        seed=seed,
        config=preset("fast"),
        origin="growth",
        attempts=(
            AttemptReport(*["growth"] * 2, "certified and polished", {"shape": 2}, {"shape": 0.5}, 0, False, 0.0),
        ),
    )
