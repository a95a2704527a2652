"""Makes the interactive scene of report.html: a volume and the fields on it as compact arrays for the page's script.

The six faces are sampled on lattices of points, and the inside on one lattice through the cube, from which the page
takes its sections. Places are 16-bit numbers between two corners of the scene, values 16-bit numbers between the ends
of their range, all in Base64: some 0.7 MB for the places and for displacements, 0.25 MB for every other field.

A scene has one frame, or several: modes, or steps in time. A frame holds the values of its fields by their names;
fields that a frame does not have are taken from the first frame.
"""

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import breakpoints
from parameterize.spline.volume import AXES, BSplineVolume
from solve import SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity

from ..figures import evaluate
from ..figures.cutaway import best_cut, patches_of
from ..figures.fields import (
    STRESS,
    Field,
    Samples,
    diagonal_of,
    distortion_of,
    error_of,
    fields_of,
    points_of,
    quantity_of,
    vectors_of,
)
from ..figures.palette import color_labels
from ..figures.style import even_range, with_unit
from ..figures.warp import factor_for, is_displacement, warp_of
from ..options import NO_UNITS, Units

Scene = dict[str, Any]

LENGTH = 3  # in place of a component: the length of the vector
COMPONENTS = {"|u|": LENGTH, "u_x": 0, "u_y": 1, "u_z": 2}  # fields that the page finds from the vectors
EVEN = 0.01  # of a field's range: where half of the boundary varies less, the view opens on the inside


@dataclass(frozen=True, eq=False)
class Frame:
    """Hold one mode, or one step in time: its fields, and its name beside the slider.

    label: a text such as "mode 1: 12.5 Hz" or "t = 0.1 s". fields: the first field is shown at first. vectors: (...,
    3), or None. displaces: whether the vectors displace the body. knots: the knots of the mesh that is drawn, by
    default the knots of the volume.
    """

    label: str
    fields: Sequence[Field]
    vectors: Samples | None = None
    displaces: bool = False
    knots: Knots | None = None

    @classmethod
    def of(cls, label: str, solution: SplineField, quantities: Mapping[str, Quantity] | None = None) -> Self:
        """Return the frame of a solution on its volume.

        quantities: further fields by their names, functions of u (c, ...), grad (c, 3, ...) and x (3, ...) that return
        (...); they stand first. Those that are not finite are left out.

        Examples
        --------
        >>> import iga_nn
        >>> from solve import benchmark_volume
        >>> heat = iga_nn.solve(benchmark_volume(1), iga_nn.Poisson(exact="x"))
        >>> frame = Frame.of("t = 0.1 s", heat, {"du/dx": lambda u, grad, x: grad[0, 0]})
        >>> [field.name for field in frame.fields]
        ['du/dx', 'solution']
        """
        named = [quantity_of(solution, quantity, name, name) for name, quantity in (quantities or {}).items()]
        fields = [field for field in named if field is not None] + fields_of(solution)
        vectors = vectors_of(solution) if solution.coefficients.shape[3:] == (3,) else None
        return cls(label, fields, vectors, is_displacement(solution), solution.knots)


def scene_of(
    volume: BSplineVolume,
    solution: SplineField | None = None,
    problem: BoundaryValueProblem | None = None,
    *,
    units: Units = NO_UNITS,
    coarser: int = 1,
) -> Scene:
    """Return the content for the script, in JSON's own types; solution and error are present where known and finite.

    units: the units in the titles of the bars. coarser: 1 for all points, 2 for every second point.
    """
    if solution is None or not np.all(np.isfinite(solution.coefficients)):
        return _scene(volume, [Frame("", [])], coarser)
    frame = Frame.of("", solution)
    if problem is not None and problem.exact is not None:
        frame = replace(frame, fields=[*frame.fields, error_of(volume, solution, problem)])
    frame = replace(frame, fields=[_with_unit(field, units) for field in frame.fields])
    return _scene(volume, [frame], coarser) | {"warp": warp_of(solution, diagonal_of(points_of(volume)))}


def _with_unit(field: Field, units: Units) -> Field:
    """Return a field with its unit in the title."""
    return replace(field, title=with_unit(field.title, units.stress if field.name == STRESS else units.displacement))


def scene_of_frames(
    volume: BSplineVolume,
    frames: Sequence[Frame],
    *,
    oscillates: bool = False,
    coarser: int = 2,
) -> Scene:
    """Return the scene of several frames, which the page plays one after another; a field has one range in all of them.

    Vectors of three components displace the body, by a factor that shows the largest well. oscillates: for modes, a
    frame swings between its displacements and their opposite. coarser: as in `scene_of`; with 2 a frame takes some
    40 kB a field, and 120 kB its displacements.
    Raises ValueError for no frames, and for frames of different fields.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> volume = benchmark_volume(1)
    >>> warm, hot = (iga_nn.solve(volume, iga_nn.Poisson(exact=exact)) for exact in ("x", "2*x"))
    >>> scene = scene_of_frames(volume, [Frame.of("t = 1 s", warm), Frame.of("t = 2 s", hot)])
    >>> [frame["label"] for frame in scene["frames"]], round(scene["fields"][0]["high"], 2)
    (['t = 1 s', 't = 2 s'], 2.15)
    """
    names = [[field.name for field in frame.fields] for frame in frames]
    if not names or any(other != names[0] for other in names):
        raise ValueError(f"frames must have the same fields, and there must be one at least, got {names}")
    limits = [
        even_range([values for field in fields for values in field.everywhere])
        for fields in zip(*(frame.fields for frame in frames), strict=True)
    ]
    alike = [
        replace(frame, fields=[replace(field, limits=ends) for field, ends in zip(frame.fields, limits, strict=True)])
        for frame in frames
    ]
    moved = [frame.vectors for frame in alike if frame.displaces and frame.vectors is not None]
    lengths = [np.linalg.norm(values, axis=-1).max() for vectors in moved for values in vectors.everywhere]
    factor = factor_for(diagonal_of(points_of(volume)), float(max(lengths, default=0.0)))
    return _scene(volume, alike, coarser) | {"warp": factor, "oscillates": oscillates}


def _scene(volume: BSplineVolume, frames: Sequence[Frame], coarser: int) -> Scene:
    """Return a scene of frames with the same fields; the distortion of the volume joins the first frame's fields."""
    points = points_of(volume)
    cloud = np.concatenate([where.reshape(-1, 3) for where in points.everywhere])
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    octant, view = best_cut(patches_of(volume, points.patches)[:6])
    count, many = (part.shape[1] for part in _thinned(points, coarser))
    whole = [replace(frames[0], fields=[*frames[0].fields, distortion_of(volume)]), *frames[1:]]
    bound = _bound(frames)
    return {
        "samples": {"faces": count, "lattice": many},  # per direction
        "low": low.tolist(),
        "high": high.tolist(),
        "view": np.stack([view.right, view.up, view.towards]).tolist(),
        "octant": list(octant),  # the octant that the cut leaves out
        "places": _both(points, coarser, lambda where: (where - low) / np.where(high > low, high - low, 1.0)),
        "axes": list(AXES),
        "spans": [breakpoints(row).tolist() for row in frames[0].knots or volume.knots],
        "colors": [color for color, _ in color_labels(volume)],
        "labels": [label for _, label in color_labels(volume)],
        "map": _packed(colormaps[evaluate.MAP](np.arange(256))[:, :3], np.uint8),  # (256, 3)
        "fields": [_described(field, frames[0]) for field in whole[0].fields],
        "frames": [_values(frame, bound, coarser) for frame in whole],
        "bound": bound,  # of the entries of all vectors
        "warp": 0.0,
        "oscillates": False,
        "opening": _opening(frames[0]),
    }


def _bound(frames: Sequence[Frame]) -> float:
    """Return the largest entry of all vectors, 1 where there are no vectors."""
    parts = [values for frame in frames if frame.vectors is not None for values in frame.vectors.everywhere]
    return max((float(np.abs(values).max()) for values in parts), default=0.0) or 1.0


def _opening(frame: Frame) -> dict[str, str]:
    """Return the first view: the first field, on the boundary, unless half of the boundary has nearly one value.

    A body is seen as a whole, because its shape is more informative than the colours inside.
    """
    if not frame.fields:
        return {"field": "faces", "part": "surface"}
    field = frame.fields[0]
    quarters = np.percentile([field.limits.shares(patch) for patch in field.patches[:6]], [25.0, 75.0])
    is_even = quarters[1] - quarters[0] < EVEN and not field.limits.remark
    return {"field": field.name, "part": "cut" if is_even and not frame.displaces else "surface"}


def _described(field: Field, frame: Frame) -> dict[str, Any]:
    """Return the words of a field for the controls and the bar; the page computes its values from vectors if it can."""
    limits = field.limits
    described = {"name": field.name, "title": field.title, "low": limits.low, "high": limits.high}
    described |= {"logarithmic": limits.logarithmic, "remark": limits.remark}
    return described | ({"component": COMPONENTS[field.name]} if _is_derived(field, frame) else {})


def _is_derived(field: Field, frame: Frame) -> bool:
    return frame.vectors is not None and field.name in COMPONENTS


def _values(frame: Frame, bound: float, coarser: int) -> dict[str, Any]:
    """Return the values of a frame, as shares of their ranges."""
    values = {
        field.name: _both(field, coarser, field.limits.shares)
        for field in frame.fields
        if not _is_derived(field, frame)
    }
    vectors = frame.vectors and _both(frame.vectors, coarser, lambda found: 0.5 + 0.5 * found / bound)
    return {"label": frame.label, "values": values, "vectors": vectors}


def _both(samples: Samples, coarser: int, shares: Callable[[Array], Array]) -> dict[str, str]:
    """Return the packed shares of samples, on the faces and in the inner lattice."""
    return {
        name: _packed(shares(part)) for name, part in zip(("faces", "lattice"), _thinned(samples, coarser), strict=True)
    }


def _thinned(samples: Samples, coarser: int) -> tuple[Array, Array]:
    """Return every second point on the six faces (6, m, m, ...) and all points in the lattice.

    With `coarser` 2 both have half as many points a direction.
    """
    step = slice(None, None, coarser)
    faces = np.stack([patch[:: 2 * coarser, :: 2 * coarser] for patch in samples.patches[:6]])
    return faces, samples.lattices[0][step, step, step]


def _packed(shares: NDArray[Any], kind: type[np.unsignedinteger[Any]] = np.uint16) -> str:
    """Return numbers 0..1 as whole numbers over the range of `kind`, little-endian, in Base64."""
    numbers = np.rint(np.clip(shares, 0.0, 1.0) * np.iinfo(kind).max).astype(np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(numbers.tobytes()).decode("ascii")
