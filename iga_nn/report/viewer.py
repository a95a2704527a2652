"""Makes the interactive scene of report.html: a body and the fields on it as compact arrays for the page's script.

The faces of the boundary are sampled on lattices of points, and the inside on one lattice through the cube of each
patch, from which the page takes its sections. Places are 16-bit numbers between two corners of the scene, values 16-bit
numbers between the ends of their range, all in Base64: of a volume some 0.7 MB for the places and for displacements,
0.25 MB for every other field.

A scene has one frame, or several: modes, or steps in time. A frame holds the values of its fields by their names;
fields that a frame does not have are taken from the first frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from parameterize.arrays import IntArray, Knots, Mask, ends_of
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.bspline import breakpoints
from parameterize.spline.volume import AXES, FACE_NAMES
from solve.field import BodyField, FieldOnBody
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity

from ..figures.colors import color_labels, face_colors, face_labels, joint_range
from ..figures.cutaway import WITH_OCTANTS, cut_of, seen_quarters
from ..figures.fields import (
    PER_PATCH,
    PLANES,
    ColoredField,
    Samples,
    distortion_of,
    error_of,
    factor_for,
    fields_of,
    is_displacement,
    is_spatial,
    outer_faces,
    points_of,
    quantity_of,
    vectors_of,
    warp_of,
)
from ..figures.first_view import shown_from
from ..figures.outline import is_by_face, smooth_colors
from ..figures.palette import SHADES
from ..options import NO_UNITS, Units
from .layers import layers_of
from .packed import Drawn, packed

Scene = dict[str, Any]

LENGTH = 3  # in place of a component: the length of the vector
COMPONENTS = {"|u|": LENGTH, "u_x": 0, "u_y": 1, "u_z": 2}  # fields that the page finds from the vectors
EVEN = 0.01  # of a field's range: where half of the boundary varies less, the view opens on the inside


@dataclass(frozen=True, eq=False)
class Frame:
    """Hold one mode, or one step in time: its fields, and its name beside the slider.

    label: a text such as "mode 1: 12.5 Hz" or "t = 0.1 s". fields: the first field is shown at first. vectors: (...,
    3), or None. displaces: whether the vectors displace the body. knots: of each patch the knots of the mesh that is
    drawn, by default those of the body.
    """

    label: str
    fields: Sequence[ColoredField]
    vectors: Samples | None = None
    displaces: bool = False
    knots: Sequence[Knots] | None = None

    @classmethod
    def of(cls, label: str, solution: FieldOnBody, quantities: Mapping[str, Quantity] | None = None) -> Self:
        """Return the frame of a solution on its body.

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
        vectors = vectors_of(solution) if is_spatial(solution) else None
        knots = [field.knots for field in solution.patches]
        return cls(label, fields, vectors, is_displacement(solution), knots)


def scene_of(
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    *,
    units: Units = NO_UNITS,
    coarser: int = 1,
) -> Scene:
    """Return the content for the script, in JSON's own types; solution and error are present where known and finite.

    units: the units in the titles of the bars. coarser: 1 for all points, 2 for every second point.
    """
    if solution is None or not all(np.all(np.isfinite(field.coefficients)) for field in solution.patches):
        return _scene(body, [Frame("", [])], coarser) | {"unit": units.length or ""}
    if isinstance(solution, BodyField) and solution.body is None:  # as a file holds it
        solution = replace(solution, body=as_body(body))
    frame = Frame.of("", solution)
    if problem is not None and problem.exact is not None:
        frame = replace(frame, fields=[*frame.fields, error_of(body, solution, problem)])
    return (
        _scene(body, [frame], coarser, solution, units)
        | {"warp": warp_of(solution, points_of(body).diagonal)}
        | {"unit": units.length or ""}
    )


def scene_of_frames(
    body: BodyLike,
    frames: Sequence[Frame],
    *,
    oscillates: bool = False,
) -> Scene:
    """Return the scene of several frames, which the page plays one after another; a field has one range in all of them.

    Vectors of three components displace the body, by a factor that shows the largest well. oscillates: for modes, a
    frame swings between its displacements and their opposite. Every second point is taken: a frame takes some 40 kB a
    field, and 120 kB its displacements.
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
        joint_range([field.limits for field in fields], [values for field in fields for values in field.everywhere])
        for fields in zip(*(frame.fields for frame in frames), strict=True)
    ]
    alike = [
        replace(frame, fields=[replace(field, limits=ends) for field, ends in zip(frame.fields, limits, strict=True)])
        for frame in frames
    ]
    moved = [frame.vectors for frame in alike if frame.displaces and frame.vectors is not None]
    lengths = [np.linalg.norm(values, axis=-1).max() for vectors in moved for values in vectors.everywhere]
    factor = factor_for(points_of(body).diagonal, float(max(lengths, default=0.0)))
    return _scene(body, alike, coarser=2) | {"warp": factor, "oscillates": oscillates}


def _coarser(points: Samples, wanted: int) -> int:
    """Return the step in which samples are taken: the wanted one where what is left has the planes of a body cut open.

    Lattices without octants need their ends alone.
    """
    rows = points.lattices.shape[1] - 1, (points.planes.shape[1] - 1) // 2
    parts = 2 * wanted if points.lattices.shape[1] >= WITH_OCTANTS else wanted
    return 1 if any(row % parts for row in rows) else wanted


def _scene(
    body: BodyLike, frames: Sequence[Frame], coarser: int, solution: FieldOnBody | None = None, units: Units = NO_UNITS
) -> Scene:
    """Return a scene of frames with the same fields; the distortion of the body joins the first frame's fields.

    solution: its regions of data and its singular places are layers of the scene, and choose the first view.
    """
    points, patches = points_of(body), as_body(body).patches
    drawn = Drawn(outer_faces(body), _coarser(points, coarser))
    low, high = ends_of(points.cloud)
    left_out, view = cut_of(body, points, points, shown_from(body, solution))
    count, many = (part.shape[1] for part in drawn.thinned(points))
    whole = [replace(frames[0], fields=[*frames[0].fields, distortion_of(body)]), *frames[1:]]
    bound = _bound(frames)
    spans, meshes = _meshes(frames[0].knots or [patch.knots for patch in patches])
    return {
        "samples": {"faces": count, "lattice": many},  # per direction
        "low": low.tolist(),
        "high": high.tolist(),
        "view": np.stack([view.right, view.up, view.towards]).tolist(),
        "outer": np.stack(np.divmod(drawn.faces, PER_PATCH), axis=1).tolist(),  # patch and face
        "cut": _cut(seen_quarters(body, left_out), drawn.faces),
        "places": drawn.packed(points, lambda where: (where - low) / np.where(high > low, high - low, 1.0)),
        "axes": list(AXES) if as_body(body).is_single else [],  # along which there are sections through the cube
        "spans": spans,
        "meshes": meshes,  # of each patch the number of its entry in `spans`
        **_colors(body, drawn.faces),
        "map": packed(SHADES, np.uint8),  # (256, 3)
        "fields": [_described(field, frames[0], units) for field in whole[0].fields],
        **layers_of(body, solution, drawn),
        "frames": [_values(frame, bound, drawn) for frame in whole],
        "bound": bound,  # of the entries of all vectors
        "warp": 0.0,
        "unit": "",
        "oscillates": False,
        "opening": _opening(frames[0], drawn.faces),
    }


def _meshes(knots: Sequence[Knots]) -> tuple[list[list[list[float]]], list[int]]:
    """Return the ends of the spans of the different meshes, in each direction, and the number of each patch's mesh."""
    numbers: dict[Any, int] = {}
    meshes = [numbers.setdefault(tuple(row.tobytes() for row in rows), len(numbers)) for rows in knots]
    _, first = np.unique(meshes, return_index=True)
    return [[breakpoints(row).tolist() for row in knots[patch]] for patch in first.tolist()], meshes


def _cut(seen: Mask, outer: IntArray) -> dict[str, list[tuple[float, ...]]]:
    """Return what is seen of a body cut open.

    These are outer faces by their numbers, with their quarters (`_bits`); and planes inside: patch, direction, its
    parameter, and quarters. Glued faces are such planes, too.
    """
    bits = (seen.reshape(-1, 4) @ (1 << np.arange(4))).astype(int)  # the quarter (i, j) is bit 2 i + j
    faces = [(number, quarters) for number, quarters in enumerate(bits[outer].tolist()) if quarters]
    inside = np.setdiff1d(np.flatnonzero(bits), outer)
    planes = [
        (k // PER_PATCH, *PLANES[k % PER_PATCH], quarters)
        for k, quarters in zip(inside.tolist(), bits[inside].tolist(), strict=True)
    ]
    return {"faces": faces, "planes": planes}


def _colors(body: BodyLike, outer: IntArray) -> dict[str, Any]:
    """Return the colours and the names of the outer faces, the legend of the colours, and each patch's solid."""
    colors, glued = np.reshape(face_colors(body), (-1, len(FACE_NAMES))), as_body(body)
    patches, faces = np.divmod(outer, PER_PATCH)
    pairs = zip(patches.tolist(), faces.tolist(), strict=True)
    named = face_labels() if glued.is_single else [glued.face_name(patch, FACE_NAMES[face]) for patch, face in pairs]
    chosen = smooth_colors(body) if is_by_face(body) else colors[patches, faces].tolist()
    found = {"colors": chosen, "labels": named, "legend": color_labels(body)}
    if glued.solids.are_several:
        found |= {"solids": glued.solids.numbers.tolist(), "solid_names": glued.solids.labels}
    return found


def _bound(frames: Sequence[Frame]) -> float:
    """Return the largest entry of all vectors, 1 where there are no vectors."""
    parts = [values for frame in frames if frame.vectors is not None for values in frame.vectors.everywhere]
    return max((float(np.abs(values).max()) for values in parts), default=0.0) or 1.0


def _opening(frame: Frame, outer: IntArray) -> dict[str, str]:
    """Return the first view: the first field, on the boundary, unless half of the boundary has nearly one value.

    A body is seen as a whole, because its shape is more informative than the colours inside.
    """
    if not frame.fields:
        return {"field": "faces", "part": "surface"}
    field = frame.fields[0]
    quarters = np.percentile(field.limits.shares(field.on(outer)), [25.0, 75.0])
    is_even = quarters[1] - quarters[0] < EVEN and not field.limits.remark
    return {"field": field.name, "part": "cut" if is_even and not frame.displaces else "surface"}


def _described(field: ColoredField, frame: Frame, units: Units) -> dict[str, Any]:
    """Return the words of a field for the controls and the bar; the page computes its values from vectors if it can."""
    limits = field.limits.whole
    described = {"name": field.name, "title": field.titled(units), "low": limits.low, "high": limits.high}
    described |= {"logarithmic": limits.logarithmic, "remark": limits.remark, "said": field.said(units)}
    described |= {"shown": [field.limits.low, field.limits.high]}
    return described | ({"component": COMPONENTS[field.name]} if _is_derived(field, frame) else {})


def _is_derived(field: ColoredField, frame: Frame) -> bool:
    return frame.vectors is not None and field.name in COMPONENTS


def _values(frame: Frame, bound: float, drawn: Drawn) -> dict[str, Any]:
    """Return the values of a frame, as shares of their ranges."""
    values = {
        field.name: drawn.packed(field, field.limits.whole.shares)
        for field in frame.fields
        if not _is_derived(field, frame)
    }
    vectors = frame.vectors and drawn.packed(frame.vectors, lambda found: 0.5 + 0.5 * found / bound)
    return {"label": frame.label, "values": values, "vectors": vectors}
