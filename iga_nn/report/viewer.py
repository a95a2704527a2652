"""Makes the interactive scene of report.html: faces and mid-sections of a volume as compact arrays for viewer.js.

Nine patches (the six faces, u = 1/2, v = 1/2, w = 1/2) are sampled on lattices of SAMPLES x SAMPLES points. Places are
16-bit numbers between two corners of the scene, values 8-bit numbers of a colour map, both in Base64: some 0.8 MB for a
volume with all its fields.
"""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume
from solve import SplineField

from ..figures import evaluate
from ..figures.evaluate import distortions, points_on, solution_on
from ..figures.render import TILT, widest_view
from ..figures.style import ColorRange, error_range, even_range
from ..options import Equation

SAMPLES = 81  # per direction of a patch

Scene = dict[str, Any]


def scene_of(
    volume: BSplineVolume,
    solution: SplineField | None = None,
    problem: "Equation | None" = None,
    *,
    samples: int = SAMPLES,
) -> Scene:
    """Return what viewer.js draws, in JSON's own types; solution and error only where they are known and finite.

    samples: points per direction of a patch.
    """
    grids = evaluate.all_grids(samples)
    points = [points_on(volume, grid) for grid in grids]
    fields = [_field("distortion", "tanh(√ARAP / 2), volume 1", distortions(volume, grids), ColorRange(0.0, 1.0))]
    if solution is not None and np.all(np.isfinite(solution.coefficients)):
        name = "u" if solution.coefficients.ndim == 3 else "|u|"
        values = [solution_on(solution, grid) for grid in grids]
        fields.append(_field("solution", name, values, even_range(values)))
        if problem is not None and problem.exact is not None:
            _, errors = evaluate.sampled_error(volume, solution, problem, samples)
            fields.append(_field("error", "|u − uₕ|, logarithmic", errors, error_range([errors])))
    cloud = np.concatenate([where.reshape(-1, 3) for where in points])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    view = widest_view(cloud[: 6 * samples**2], tilt=TILT)
    frame = np.stack([view.right, view.up, view.towards])
    half = np.abs((cloud - (low + high) / 2.0) @ frame[:2].T).max(axis=0)  # width and height as first seen
    return {
        "samples": samples,
        "low": low.tolist(),
        "high": high.tolist(),
        "view": frame.tolist(),
        "half": half.tolist(),
        "places": _packed((cloud - low) / np.where(high > low, high - low, 1.0), np.uint16),
        "colors": list(evaluate.FACE_COLORS),
        "labels": evaluate.face_labels(),
        "map": _packed(colormaps[evaluate.MAP](np.arange(256))[:, :3]),  # (256, 3)
        "fields": fields,
    }


def _field(name: str, title: str, patches: Sequence[Array], limits: ColorRange) -> dict[str, str]:
    """Return the values on the nine patches, coloured between the limits."""
    low, high = limits.labels
    return {"name": name, "title": title, "low": low, "high": high, "values": _packed(limits.shares(np.stack(patches)))}


def _packed(shares: NDArray[Any], kind: type[np.unsignedinteger[Any]] = np.uint8) -> str:
    """Return numbers 0..1 as whole numbers over the range of `kind`, little-endian, in Base64."""
    numbers = np.rint(np.clip(shares, 0.0, 1.0) * np.iinfo(kind).max).astype(np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(numbers.tobytes()).decode("ascii")
