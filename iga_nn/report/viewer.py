"""Makes the interactive scene of report.html: a volume and the fields on it as compact arrays for the page's script.

The six faces are sampled on lattices of points, the inside on one lattice through the cube, whose planes are the
sections that the page shows. Places are 16-bit numbers between two corners of the scene, values 16-bit numbers between
the ends of their colour bar, all in Base64: some 1.8 MB for a volume with all its fields.
"""

import base64
from typing import Any

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.spline.volume import AXES, BSplineVolume
from solve import SplineField

from ..figures import evaluate
from ..figures.cutaway import best_cut, patches_of
from ..figures.fields import Field, Samples, distortion_of, error_of, points_of, solution_of
from ..options import Equation

Scene = dict[str, Any]


def scene_of(
    volume: BSplineVolume,
    solution: SplineField | None = None,
    problem: "Equation | None" = None,
    *,
    coarser: int = 1,
) -> Scene:
    """Return what the script draws, in JSON's own types; solution and error only where they are known and finite.

    coarser: 2 leaves out every second point.
    """
    points, fields = points_of(volume), [distortion_of(volume)]
    if solution is not None and np.all(np.isfinite(solution.coefficients)):
        fields.append(solution_of(solution))
        if problem is not None and problem.exact is not None:
            fields.append(error_of(volume, solution, problem))
    cloud = np.concatenate([where.reshape(-1, 3) for where in points.everywhere])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    octant, view = best_cut(patches_of(points.patches)[:6])
    frame = np.stack([view.right, view.up, view.towards])
    half = np.abs((cloud - (low + high) / 2.0) @ frame[:2].T).max(axis=0)  # width and height as first seen
    places = Samples([_shares(where, low, high) for where in points.patches], _shares(points.lattice, low, high))
    faces, lattice = _thinned(places, coarser)
    return {
        "samples": {"faces": faces.shape[1], "lattice": len(lattice)},  # per direction
        "low": low.tolist(),
        "high": high.tolist(),
        "view": frame.tolist(),
        "half": half.tolist(),
        "octant": list(octant),  # what the cut leaves out
        "places": {"faces": _packed(faces), "lattice": _packed(lattice)},
        "axes": list(AXES),
        "colors": list(evaluate.FACE_COLORS),
        "labels": evaluate.face_labels(),
        "map": _packed(colormaps[evaluate.MAP](np.arange(256))[:, :3], np.uint8),  # (256, 3)
        "fields": [_described(field, coarser) for field in fields],
    }


def _described(field: Field, coarser: int) -> dict[str, Any]:
    """Return a field with its values as places between the ends of its range."""
    low, high = field.limits.labels
    faces, lattice = _thinned(field, coarser)
    values = {name: _packed(field.limits.shares(part)) for name, part in (("faces", faces), ("lattice", lattice))}
    return {"name": field.name, "title": field.title, "low": low, "high": high, "values": values}


def _thinned(samples: Samples, coarser: int) -> tuple[Array, Array]:
    """Return every second point on the six faces (6, m, m, ...) and all in the lattice; fewer, where `coarser` is 2."""
    step = slice(None, None, coarser)
    faces = np.stack([patch[:: 2 * coarser, :: 2 * coarser] for patch in samples.patches[:6]])
    return faces, samples.lattice[step, step, step]


def _shares(points: Array, low: Array, high: Array) -> Array:
    return np.asarray((points - low) / np.where(high > low, high - low, 1.0))


def _packed(shares: NDArray[Any], kind: type[np.unsignedinteger[Any]] = np.uint16) -> str:
    """Return numbers 0..1 as whole numbers over the range of `kind`, little-endian, in Base64."""
    numbers = np.rint(np.clip(shares, 0.0, 1.0) * np.iinfo(kind).max).astype(np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(numbers.tobytes()).decode("ascii")
