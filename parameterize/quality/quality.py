"""QualityReport: how much a trivariate spline, or a body of several, distorts, and how well it fits its mesh."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray, in_brackets, in_percent
from ..certificate.boundary import BoundaryCheck
from ..certificate.certify import Certificate
from ..certificate.jacobian import PatchCertificate
from ..cube.boundary_map import BoundaryMap, on_faces
from ..display import Shown
from ..spline.body import Body, BodyLike, as_body, shared_numbers
from ..spline.interface import face_layer
from ..spline.orientation import enclosed_volumes
from ..spline.volume import BSplineVolume
from ..surface.features import SHARP
from ..surface.geometry import signed_volume
from .distances import Distances, two_sided
from .distortion import BoxDistortion, Distortion, arap_grid, in_own_boxes
from .sharpness import Sharpness, sharpness_of

Measure = TypeVar("Measure", Distortion, Distances)

# A map that is farther from its surface, in shares of the diagonal of the surface's box and of the volume, is not
# offered as the part. Maps that serve are within 0.5 % (docs/benchmarks); those of parts of which a wall or a leg is
# missing were off by 3 to 70 %.
FARTHEST, MOST_VOLUME = 0.02, 0.02
MOST_LINES = 40  # of patches in a printed report


@dataclass(frozen=True)
class BothScales(Generic[Measure]):  # noqa: UP046 - the new syntax needs Python 3.12
    """A measure twice: with the model brought to volume 1, and in the user's units."""

    unit_volume: Measure
    as_given: Measure


@dataclass(frozen=True)
class Volumes:
    """The volumes of a spline, and of the solid inside its mesh, in the user's units."""

    spline: float
    mesh: float

    @property
    def difference(self) -> float:
        """Return the spline's volume minus the mesh's, over the mesh's."""
        return (self.spline - self.mesh) / self.mesh

    def as_dict(self) -> dict[str, float]:
        """Return the volumes and their difference."""
        return asdict(self) | {"difference": self.difference}


@dataclass(frozen=True)
class QualityReport(Shown):
    """The `parameterization` section of report.json.

    Each measure has `unit_volume`, the model brought to volume 1, and `as_given`, in the user's units.

    Attributes
    ----------
    control_points : three int, or int
        Of a volume by direction; of several patches their number, shared ones once.
    degrees : tuple of int
        Of a volume by direction; of several patches those that occur.
    certificate : Certificate
        Whether det J > 0 on the whole cube of each patch, its lower bound, the witness of a fold.
    boundary_check : BoundaryCheck
        Whether the outer faces meet only at their common edges, and a point where they meet elsewhere.
    arap : BothScales of Distortion
        Mean and max of the sum of (sigma_i - 1)^2, the smallest sigma signed with det J, over `arap_points` Gauss
        points. Each of several patches is measured against its own box, in which no unit is left: both measures are the
        mean over the patches, weighted by their volumes, and the largest of all.
    arap_points : int
    boundary : BothScales of Distances
        Rms, mean and max of the distance from F(v_p) to v over the mesh's own `mesh_vertices` vertices; cuts and
        subdivisions do not count.
    mesh_vertices : int
    mesh_to_spline, spline_to_mesh : BothScales of Distances
        From samples on the mesh's triangles to the spline's boundary (foot point refined on the spline), and from
        samples on this to the mesh; rms and mean over the area. `mesh_samples` and `spline_samples` say how many.
    surface_distance : BothScales of Distances
        Both ways together: rms and mean of the two, the largest of all samples.
    volumes : Volumes
        Of the spline, by its six faces (folded parts count with the opposite sign), and of the solid inside the mesh.
    diagonal : float
        Of the mesh's bounding box, in the user's units.
    mesh_samples, spline_samples : int
    proof : dict
        The entries of report.json on what is proved.
    sharpness : Sharpness
        The sharp edges of the mesh, how far they are from edges of F, and the angles between normals.
    patches : tuple of BoxDistortion
        Of each of several patches its box, volume, distortion and smallest scaled Jacobian.

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.02).with_control_points(6)  # a quick look
    >>> quality = iga_nn.parameterize(iga_nn.sample("cube"), config).quality
    >>> quality.mesh_vertices, quality.arap.unit_volume.mean >= 0.0
    (1538, True)
    """

    control_points: tuple[int, int, int] | int
    degrees: tuple[int, ...]
    certificate: Certificate
    arap: BothScales[Distortion]
    arap_points: int
    boundary: BothScales[Distances]
    mesh_vertices: int
    mesh_to_spline: BothScales[Distances]
    spline_to_mesh: BothScales[Distances]
    surface_distance: BothScales[Distances]
    volumes: Volumes
    diagonal: float
    mesh_samples: int
    spline_samples: int
    boundary_check: BoundaryCheck
    proof: dict[str, Any]
    sharpness: Sharpness
    patches: tuple[BoxDistortion, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the section in plain Python types, ready for JSON; a bound that is not finite is None."""
        return (
            self.proof
            | ({"not_the_part": list(self.not_the_part)} if self.not_the_part else {})
            | {
                "arap": asdict(self.arap),
                "boundary": asdict(self.boundary),
                "surface_distance": {
                    "mesh_to_spline": asdict(self.mesh_to_spline),
                    "spline_to_mesh": asdict(self.spline_to_mesh),
                    "two_sided": asdict(self.surface_distance) | {"of_diagonal": asdict(self.relative_distance)},
                },
                "volume": self.volumes.as_dict(),
                "sharp_edges": self.sharpness.as_dict(),
                "points": {
                    "arap": self.arap_points,
                    "boundary": self.mesh_vertices,
                    "mesh_to_spline": self.mesh_samples,
                    "spline_to_mesh": self.spline_samples,
                },
                **({"patches": self._each_patch()} if self.patches else {}),
            }
        )

    def _each_patch(self) -> list[dict[str, Any]]:
        """Return what is proved and measured of each patch."""
        return [
            known
            | {
                "own_box": list(found.box),
                "volume": found.volume,
                "arap": asdict(found.arap),
                "scaled_jacobian": found.scaled_jacobian,
            }
            for known, found in zip(self.proof["patches"], self.patches, strict=True)
        ]

    @property
    def relative_distance(self) -> Distances:
        """The distance between surface and spline, both ways, over the diagonal of the surface's bounding box."""
        return self.surface_distance.as_given.scaled(1.0 / self.diagonal)

    @property
    def not_the_part(self) -> tuple[str, ...]:
        """The reasons why the volume does not stand for its surface: distance, volume; none where it does."""
        farthest, off = self.relative_distance.max, self.volumes.difference
        reasons = []
        if not farthest <= FARTHEST:
            reasons.append(f"its boundary is up to {in_percent(farthest)} of the diagonal from the surface")
        if not abs(off) <= MOST_VOLUME:
            reasons.append(f"its volume is {in_percent(abs(off))} {'less' if off < 0.0 else 'more'} than the part's")
        return tuple(reasons)

    def __str__(self) -> str:
        lines = [
            *(f"NOT THE PART: {reason}" for reason in self.not_the_part),
            f"{self._size}: {self._verdict}",
            f"{'':16}  {'at volume 1':<32}  as given",
            _line("ARAP mean, max", self.arap),
            f"{'':16}  {'rms, mean, max':<32}  rms, mean, max",
            _line("at the vertices", self.boundary),
            _line("mesh to spline", self.mesh_to_spline),
            _line("spline to mesh", self.spline_to_mesh),
            _line("both ways", self.surface_distance),
        ]
        return "\n".join([*lines, *_lines_of(self.patches)])

    @property
    def _size(self) -> str:
        points, degrees = self.control_points, ", ".join(map(str, self.degrees))
        if isinstance(points, int):
            return f"{points} control points of degree {degrees} in {len(self.patches)} patches"
        return f"{' x '.join(map(str, points))} control points of degree {degrees}"

    @property
    def _verdict(self) -> str:
        found = self.certificate
        verdict = f"{found.verdict}, det J >= {found.lower_bound:.3g} of its mean"
        if self.patches:
            verdict = str(found)
        elif found.witness is not None:
            verdict = f"folded at {in_brackets(found.witness)}"
        meeting = self.boundary_check.meeting
        return verdict if meeting is None else f"{verdict}; the boundary {meeting}"


def _lines_of(patches: Sequence[BoxDistortion]) -> list[str]:
    """Return a table of patches, a line each, of many the most distorted ones; no line for no patches."""
    worst = sorted(range(len(patches)), key=lambda number: patches[number].arap.max)[-MOST_LINES:]
    rows = [
        f"{f'p{number}':16}  {' x '.join(f'{side:.3g}' for side in found.box):<32}  "
        f"{found.arap.mean:.4g}, {found.arap.max:.4g}, {found.scaled_jacobian:.4g}"
        for number, found in ((number, patches[number]) for number in sorted(worst))
    ]
    if len(patches) > MOST_LINES:
        rows.append(f"{'':16}  the {len(patches) - MOST_LINES} other patches are less distorted")
    return [f"{'':16}  {'own box':<32}  ARAP mean, max, scaled det J", *rows] if rows else []


def _line(name: str, measure: BothScales[Any]) -> str:
    unit, given = (", ".join(f"{v:.4g}" for v in asdict(m).values()) for m in (measure.unit_volume, measure.as_given))
    return f"{name:16}  {unit:<32}  {given}"


def measure(
    body: BodyLike,
    surface_vertices: ArrayLike,
    surface_faces: ArrayLike,
    scale: float,
    boundary: BoundaryMap,
    certificate: Certificate,
    boundary_check: BoundaryCheck,
    sharp: float = SHARP,
) -> QualityReport:
    """Measure a volume or several patches against their mesh; return the measures together with the certificate.

    body, surface_vertices (n, 3), surface_faces (m, 3) and boundary: all in the user's units. The boundary map starts
    with the surface's vertices, in their order.
    scale: the factor that brings the model to volume 1 (Surface.scale).
    certificate, boundary_check: from `certify` and `check_boundary`, of the same body.
    sharp: the angle in degrees above which an edge of the mesh is sharp.
    Raises ValueError for a scale that is not positive, and for a boundary map of fewer vertices or with vertices on no
    outer face of the body; TypeError for the certificate of another kind of body.
    """
    if not (isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale must be positive, got {scale}; pass Surface.scale")
    vertices = np.asarray(surface_vertices, dtype=np.float64)
    faces = np.asarray(surface_faces, dtype=np.int64)
    n, body = len(vertices), as_body(body)
    if len(certificate.patches) != len(body):
        raise TypeError("certificate is not that of this body: pass certify(body)")
    if len(boundary.vertices) < n:
        raise ValueError(f"boundary must start with the surface's {n} vertices, it has {len(boundary.vertices)}")
    gaps = np.linalg.norm(_placed(body, boundary, n) - boundary.vertices[:n], axis=1)
    found = two_sided(body, vertices, faces)
    measured: dict[str, Any] = {
        "boundary": _both(Distances.of(gaps), scale),
        "mesh_vertices": n,
        "mesh_to_spline": _both(found.mesh_to_spline.summary(), scale),
        "spline_to_mesh": _both(found.spline_to_mesh.summary(), scale),
        "surface_distance": _both(found.summary(), scale),
        "volumes": _volumes(body, vertices, faces),
        "diagonal": float(np.linalg.norm(np.ptp(vertices, axis=0))),
        "mesh_samples": len(found.mesh_to_spline.distances),
        "spline_samples": len(found.spline_to_mesh.distances),
        "sharpness": sharpness_of(body, vertices, faces, sharp),
    }
    if not body.is_single:
        return _of_patches(body, certificate, boundary_check, measured)
    _, (unit_volume, as_given), weights = arap_grid(body.only, scales=(scale, 1.0))
    return QualityReport(
        control_points=body.only.shape,
        degrees=body.only.degrees,
        certificate=certificate,
        arap=BothScales(_distortion(unit_volume, weights), _distortion(as_given, weights)),
        arap_points=weights.size,
        boundary_check=boundary_check,
        proof=proved(body, certificate, boundary_check),
        **measured,
    )


def _of_patches(
    body: Body, certificate: Certificate, boundary_check: BoundaryCheck, measured: dict[str, Any]
) -> QualityReport:
    """Return the report on several patches, each measured against its own box."""
    patches, proof = in_own_boxes(body), proved(body, certificate, boundary_check)
    mean = np.average([one.arap.mean for one in patches], weights=[abs(one.volume) for one in patches])
    whole = Distortion(float(mean), max(one.arap.max for one in patches))
    return QualityReport(
        control_points=proof["control_points"],
        degrees=tuple(sorted({degree for patch in body for degree in patch.degrees})),
        certificate=certificate,
        arap=BothScales(whole, whole),
        arap_points=sum(one.points for one in patches),
        boundary_check=boundary_check,
        proof=proof,
        patches=patches,
        **measured,
    )


def _placed(body: Body, boundary: BoundaryMap, count: int) -> Array:
    """Return the points (count, 3) of a body at the places of the first vertices of a boundary map.

    Raises ValueError where a vertex lies on a patch that does not exist, or on no outer face of its patch.
    """
    patches, parameters = boundary.patches[:count], boundary.parameters[:count]
    points = body.points(patches, parameters)
    if body.is_single:
        return points
    lost = np.flatnonzero(~np.any(on_faces(parameters) & ~body.glued[patches], axis=1))
    if lost.size:
        first = lost[0]
        raise ValueError(
            f"{lost.size} vertices of the boundary lie on no outer face of their patch, the first is vertex {first} "
            f"at {in_brackets(parameters[first])} of patch {patches[first]}"
        )
    return points


def _volumes(body: Body, vertices: Array, faces: IntArray) -> Volumes:
    middle = vertices.mean(axis=0)
    enclosed = (np.abs(enclosed_volumes(group, middle)).sum() for group in body.groups)
    return Volumes(float(sum(enclosed)), abs(signed_volume(vertices - middle, faces)))


def _both(as_given: Distances, scale: float) -> BothScales[Distances]:
    return BothScales(as_given.scaled(scale), as_given)


def _distortion(values: Array, weights: Array) -> Distortion:
    return Distortion(float(np.sum(weights * values)), float(values.max()))


CELLS = (3, 3, 3)  # of a cube: its corners, the middles of its edges and faces, and its own


def proved(body: Body, certificate: Certificate, check: BoundaryCheck) -> dict[str, Any]:
    """Return the entries of a body that was certified: of several patches those of each under `patches`, too."""
    if body.is_single:
        return _of_patch(body.only, certificate.only, check.as_dict())
    return {
        "control_points": body.numbering[1],
        "bijective": certificate.verdict,
        **check.as_dict(),
        **({"overlap": True} if check.overlap else {}),
        "det_lower_bound": _finite(certificate.lower_bound),
        "outer_faces": sum(map(len, body.outer)),
        "euler_number": euler_number(body),
        "interfaces": [str(interface) for interface in body.interfaces],
        **({} if body.solids.is_plain else {"solids": solids_of(body)}),
        **({"misglued": [str(interface) for interface in certificate.misglued]} if certificate.misglued else {}),
        "patches": [_of_patch(patch, own, {}) for patch, own in zip(body, certificate.patches, strict=True)],
    }


def solids_of(body: Body) -> list[dict[str, Any]]:
    """Return the name, the number of patches and the volume of each solid of a body."""
    volumes, numbers = np.empty(len(body)), body.solids.numbers
    for group in body.groups:
        volumes[group.numbers] = np.abs(enclosed_volumes(group, group.control_points.mean(axis=(1, 2, 3))))
    labels = body.solids.labels
    counts = np.bincount(numbers, minlength=len(labels)).tolist()
    sums = np.bincount(numbers, volumes, minlength=len(labels)).tolist()
    return [
        {"name": name, "patches": count, "volume": volume}
        for name, count, volume in zip(labels, counts, sums, strict=True)
    ]


def _of_patch(patch: BSplineVolume, certificate: PatchCertificate, checked: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a patch. checked: those of its boundary check, none for one patch of several."""
    return {
        "control_points": list(patch.shape),
        "degrees": list(patch.degrees),
        "bijective": certificate.verdict,
        "orientation": certificate.orientation,
        **checked,
        "det_lower_bound": _finite(certificate.lower_bound),
        "witness": None if certificate.witness is None else list(certificate.witness),
    }


def _finite(bound: float) -> float | None:
    return bound if isfinite(bound) else None


def euler_number(body: Body) -> int:
    """Return corners minus edges plus faces of the outer boundary: 2 for a ball, 0 for a ring, -2 for two handles."""
    labels, _ = shared_numbers([CELLS] * len(body), body.interfaces)
    layers = [face_layer(label, name) for label, names in zip(labels, body.outer, strict=True) for name in names]
    corners = {int(label) for layer in layers for label in layer[::2, ::2].ravel()}
    edges = {int(label) for layer in layers for label in (*layer[1, ::2], *layer[::2, 1])}
    return len(corners) - len(edges) + len(layers)
