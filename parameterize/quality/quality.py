"""QualityReport: how much a trivariate spline distorts, and how well it fits the mesh it came from."""

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, in_brackets
from ..certificate.boundary import BoundaryCheck
from ..certificate.jacobian import Certificate
from ..cube.boundary_map import BoundaryMap
from ..display import Shown
from ..spline.bspline import gauss_points
from ..spline.orientation import mirrored, orientation
from ..spline.volume import BSplineVolume
from .distances import Distances
from .rotations import closest_rotations
from .two_sided import two_sided

_SLAB_POINTS = 100_000


@dataclass(frozen=True)
class Distortion:
    """ARAP distortion: mean is the integral over the cube, max the largest at the quadrature points."""

    mean: float
    max: float


Measure = TypeVar("Measure", Distortion, Distances)


@dataclass(frozen=True)
class BothScales(Generic[Measure]):  # noqa: UP046 - the new syntax needs Python 3.12
    """A measure twice: with the model brought to volume 1, and in the user's units."""

    unit_volume: Measure
    as_given: Measure


@dataclass(frozen=True)
class QualityReport(Shown):
    """The `parameterization` section of report.json.

    Each measure has `unit_volume`, the model brought to volume 1, and `as_given`, in the user's units.

    Attributes
    ----------
    control_points : three int
    degrees : three int
    certificate : Certificate
        Whether det J > 0 on the whole cube, its lower bound, the witness of a fold.
    boundary_check : BoundaryCheck
        Whether the six boundary surfaces meet only at their common edges, and a point where they meet elsewhere.
    arap : BothScales of Distortion
        Mean and max of the sum of (sigma_i - 1)^2, the smallest sigma signed with det J, over `arap_points` Gauss
        points.
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
    diagonal : float
        Of the mesh's bounding box, in the user's units.
    mesh_samples, spline_samples : int

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.02).with_control_points(6)  # a quick look
    >>> quality = iga_nn.parameterize(iga_nn.sample("cube"), config).quality
    >>> quality.mesh_vertices, quality.arap.unit_volume.mean >= 0.0
    (1538, True)
    """

    control_points: tuple[int, int, int]
    degrees: tuple[int, int, int]
    certificate: Certificate
    arap: BothScales[Distortion]
    arap_points: int
    boundary: BothScales[Distances]
    mesh_vertices: int
    mesh_to_spline: BothScales[Distances]
    spline_to_mesh: BothScales[Distances]
    surface_distance: BothScales[Distances]
    diagonal: float
    mesh_samples: int
    spline_samples: int
    boundary_check: BoundaryCheck

    def as_dict(self) -> dict[str, Any]:
        """Return the section in plain Python types, ready for JSON; a bound that is not finite is None."""
        return proved(self.control_points, self.degrees, self.certificate, self.boundary_check) | {
            "arap": asdict(self.arap),
            "boundary": asdict(self.boundary),
            "surface_distance": {
                "mesh_to_spline": asdict(self.mesh_to_spline),
                "spline_to_mesh": asdict(self.spline_to_mesh),
                "two_sided": asdict(self.surface_distance) | {"of_diagonal": asdict(self.relative_distance)},
            },
            "points": {
                "arap": self.arap_points,
                "boundary": self.mesh_vertices,
                "mesh_to_spline": self.mesh_samples,
                "spline_to_mesh": self.spline_samples,
            },
        }

    @property
    def relative_distance(self) -> Distances:
        """The distance between surface and spline, both ways, over the diagonal of the surface's bounding box."""
        return self.surface_distance.as_given.scaled(1.0 / self.diagonal)

    def __str__(self) -> str:
        certificate = self.certificate
        verdict = f"{certificate.verdict}, det J >= {certificate.lower_bound:.3g} of its mean"
        if certificate.witness is not None:
            verdict = f"folded at {in_brackets(certificate.witness)}"
        if self.boundary_check.meeting is not None:
            verdict += f"; the boundary {self.boundary_check.meeting}"
        size = " x ".join(map(str, self.control_points))
        lines = [
            f"{size} control points of degree {', '.join(str(p) for p in self.degrees)}: {verdict}",
            f"{'':16}  {'at volume 1':<32}  as given",
            _line("ARAP mean, max", self.arap),
            f"{'':16}  {'rms, mean, max':<32}  rms, mean, max",
            _line("at the vertices", self.boundary),
            _line("mesh to spline", self.mesh_to_spline),
            _line("spline to mesh", self.spline_to_mesh),
            _line("both ways", self.surface_distance),
        ]
        return "\n".join(lines)


def proved(
    shape: tuple[int, int, int],
    degrees: tuple[int, int, int],
    certificate: Certificate,
    check: BoundaryCheck | None = None,
) -> dict[str, Any]:
    """Return the section's entries for a volume that was certified, but not measured.

    check: None for one patch of several, whose boundary is checked as a whole.
    """
    bound = certificate.lower_bound
    return {
        "control_points": list(shape),
        "degrees": list(degrees),
        "bijective": certificate.verdict,
        "orientation": certificate.orientation,
        **({} if check is None else check.as_dict()),
        "det_lower_bound": bound if isfinite(bound) else None,
        "witness": None if certificate.witness is None else list(certificate.witness),
    }


def _line(name: str, measure: BothScales[Any]) -> str:
    unit, given = (", ".join(f"{v:.4g}" for v in asdict(m).values()) for m in (measure.unit_volume, measure.as_given))
    return f"{name:16}  {unit:<32}  {given}"


def measure(
    volume: BSplineVolume,
    surface_vertices: ArrayLike,
    surface_faces: ArrayLike,
    scale: float,
    boundary: BoundaryMap,
    certificate: Certificate,
    boundary_check: BoundaryCheck,
) -> QualityReport:
    """Measure a volume against the mesh it came from; return the measures together with its certificate.

    volume, surface_vertices (n, 3), surface_faces (m, 3) and boundary: all in the user's units. The boundary map starts
    with the surface's vertices, in their order.
    scale: the factor that brings the model to volume 1 (Surface.scale).
    certificate, boundary_check: from `certify` and `check_boundary`.
    Raises ValueError for a scale that is not positive or a boundary map of fewer vertices.
    """
    if not (isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale must be positive, got {scale}; pass Surface.scale")
    vertices = np.asarray(surface_vertices, dtype=np.float64)
    faces = np.asarray(surface_faces, dtype=np.int64)
    n = len(vertices)
    if len(boundary.vertices) < n:
        raise ValueError(f"boundary must start with the surface's {n} vertices, it has {len(boundary.vertices)}")
    found = two_sided(volume, vertices, faces)
    _, (unit_volume, as_given), weights = arap_grid(volume, scales=(scale, 1.0))
    return QualityReport(
        control_points=volume.shape,
        degrees=volume.degrees,
        certificate=certificate,
        arap=BothScales(_distortion(unit_volume, weights), _distortion(as_given, weights)),
        arap_points=weights.size,
        boundary=_both(
            Distances.of(np.linalg.norm(volume(boundary.parameters[:n]) - boundary.vertices[:n], axis=1)), scale
        ),
        mesh_vertices=n,
        mesh_to_spline=_both(found.mesh_to_spline.summary(), scale),
        spline_to_mesh=_both(found.spline_to_mesh.summary(), scale),
        surface_distance=_both(found.summary(), scale),
        diagonal=float(np.linalg.norm(np.ptp(vertices, axis=0))),
        mesh_samples=len(found.mesh_to_spline.distances),
        spline_samples=len(found.spline_to_mesh.distances),
        boundary_check=boundary_check,
    )


def _both(as_given: Distances, scale: float) -> BothScales[Distances]:
    return BothScales(as_given.scaled(scale), as_given)


def _distortion(values: Array, weights: Array) -> Distortion:
    return Distortion(float(np.sum(weights * values)), float(values.max()))


def arap_grid(
    volume: BSplineVolume, n_gauss: int = 3, scales: tuple[float, ...] = (1.0,)
) -> tuple[tuple[Array, Array, Array], list[Array], Array]:
    """Return the ARAP distortion of scale * F, for each of the scales, at `n_gauss` Gauss points a direction and span.

    Returns the points of each axis, the values (m_u, m_v, m_w) for each scale, and the weights of the integral over the
    cube.
    """
    rules = [gauss_points(k, n_gauss) for k in volume.knots]
    u, v, w = (points.ravel() for points, _ in rules)
    values = [np.empty((len(u), len(v), len(w))) for _ in scales]
    step = max(1, _SLAB_POINTS // (len(v) * len(w)))
    for start in range(0, len(u), step):  # slabs bound the memory
        slab = slice(start, start + step)
        for row, found in zip(values, _arap(_unmirrored(volume, u[slab], v, w), scales), strict=True):
            row[slab] = found
    weights = np.einsum("i,j,k->ijk", *(weights.ravel() for _, weights in rules))
    return (u, v, w), values, weights


def arap_on(volume: BSplineVolume, u: ArrayLike, v: ArrayLike, w: ArrayLike, scale: float = 1.0) -> Array:
    """Return the ARAP distortion of scale * F on a tensor grid: (len(u), len(v), len(w)).

    A left-handed volume is as distorted as its mirror image.
    """
    return _arap(_unmirrored(volume, u, v, w), (scale,))[0]


def _unmirrored(volume: BSplineVolume, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
    """Return the Jacobian on a tensor grid, of a left-handed volume that of its mirror image."""
    return (volume if orientation(volume) > 0 else mirrored(volume)).grid_jacobian(u, v, w)


def arap(jacobians: ArrayLike) -> Array:
    """Return the as-rigid-as-possible distortion sum (sigma_i - 1)^2, sigma_3 signed like det: (..., 3, 3) -> (...).

    (Paper, section 3.2, which leaves the sign open: with it the mirror image of a rigid map costs 4, not 0.)
    Raises ValueError for another shape or entries that are not finite.
    """
    matrices = np.asarray(jacobians, dtype=np.float64)
    if matrices.shape[-2:] != (3, 3):
        raise ValueError(f"jacobians must have shape (..., 3, 3), got {matrices.shape}")
    if not np.all(np.isfinite(matrices)):
        raise ValueError("jacobians must be finite")
    return _arap(matrices, (1.0,))[0]


def _arap(jacobians: Array, scales: tuple[float, ...]) -> list[Array]:
    """Return the distortion of scale * J for each scale: the squared distance to the rotation closest to J."""
    columns = np.ascontiguousarray(np.moveaxis(jacobians.reshape(-1, 3, 3), 0, -1))
    rotations = closest_rotations(columns)
    values = [((scale * columns - rotations) ** 2).sum(axis=(0, 1)) for scale in scales]
    return [value.reshape(jacobians.shape[:-2]) for value in values]


def scaled_jacobian(jacobians: ArrayLike) -> Array:
    """Return det J over the product of its columns' lengths, -1 to 1, 0 where one vanishes: (..., 3, 3) -> (...)."""
    matrices = np.asarray(jacobians, dtype=np.float64)
    lengths = np.linalg.norm(matrices, axis=-2, keepdims=True)
    units = np.divide(matrices, lengths, out=np.zeros_like(matrices), where=lengths > 0.0)
    return np.linalg.det(units)
