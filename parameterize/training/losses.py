"""Computes the training loss L = L_inner + L_bound (paper, eq. (2) and (3)): its weighted sum, and one function a term.

Each term has the name of its weight in `StageWeights`. The paper gives the formulas of the terms without numbers: those
of L_bound in section 4.4.1, those of L_inner in 4.4.2.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from ..arrays import IntArray
from ..config import StageName
from ..cube.cube import CORNERS
from ..quality.rotations import closest_rotations
from .network import InverseMap, map_in_pieces
from .target_shapes import nearest, nearest_on_cube_face
from .training_points import OFFSETS, Stencils, TriangleSampler, gather

Target = Literal["S(2)", "S(1)", "cube"]


@dataclass(frozen=True)
class StageWeights:
    """Hold the weights of the loss terms in one stage, a row of the paper's Table 1; the defaults are its first row."""

    bij: float = 1e6
    arap: float = 1.0
    fair: float = 2e-3
    dist: float = 1e3
    norm: float = 10.0
    star: float = 1e3
    cor: float = 0.0
    edge: float = 0.0


@dataclass(frozen=True)
class Stage:
    """Hold the target shape of the mapped surface in a stage, and the weights of the loss."""

    target: Target
    weights: StageWeights


_FREE = StageWeights()
_HELD = StageWeights(dist=1e4, cor=1e3)
STAGES: dict[StageName, Stage] = {  # S(2) and S(1) are the paper's first stage
    "S(2)": Stage("S(2)", _FREE),
    "S(1)": Stage("S(1)", _FREE),
    "cube": Stage("cube", _FREE),
    "corners": Stage("cube", _HELD),
    "edges": Stage("cube", replace(_HELD, edge=1e4)),
}


_ALPHA = 0.1  # determinants of G's Jacobian below this count as folds (section 4.4.2)
_LEAST_DET = 0.5 * _ALPHA  # held in the distortion term: bijectivity rules below it, and 1 / det must not blow up
_INWARD_NORMALS = 100.0  # weight, within the normal term, of normals that point inwards, once the shape is the cube
_DIRECTIONS = 1e-3  # weight of the paths' directions within the edge term
_GIVEN_CORNERS = 1e2  # weight of the corner term in stages of which Table 1 has none (section 5.4)
_POSITION = {tuple(offset): i for i, offset in enumerate(OFFSETS.tolist())}
_UNITS = np.eye(3, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class EdgePaths:
    """Hold the paths that go to the cube's edges: vertices (k,), targets (k, 3), pairs of neighbours (s, 2)."""

    vertices: Tensor
    targets: Tensor
    following: Tensor


@dataclass(frozen=True, eq=False)
class BoundaryData:
    """Hold the surface data of a stage: vertices (n, 3) at volume 1, triangles (m, 3), the sampler of the triangles.

    Later stages also have corners (8,), the vertices that go to the cube's corners; labels (m,), the cube face of each
    triangle; and the paths to the cube's edges.
    """

    vertices: Tensor
    faces: Tensor
    sampler: TriangleSampler
    corners: Tensor | None = None
    labels: Tensor | None = None
    paths: EdgePaths | None = None


@dataclass(frozen=True, eq=False)
class Objective:
    """Compute the loss of every stage from the network's values at stencils inside the domain and on the surface."""

    network: InverseMap
    stencils: Stencils

    def __call__(
        self, stage: Stage, boundary: BoundaryData, generator: torch.Generator
    ) -> tuple[Tensor, int, dict[str, float]]:
        """Return the weighted sum of the terms (eq. (2), (3)), the number of folded stencils, the unweighted terms."""
        picks = boundary.sampler.draw(generator)
        used, place = torch.unique(boundary.faces[picks].flatten(), return_inverse=True)
        held = [] if boundary.corners is None else [boundary.corners]
        held += [] if boundary.paths is None else [boundary.paths.vertices]
        points = [self.stencils.shifted(generator), *(boundary.vertices[index] for index in (used, *held))]
        mapped = map_in_pieces(self.network, torch.cat(points))
        nodes, surface, *held = torch.split(mapped, [len(p) for p in points])
        surface = gather(surface, place)
        goal = self._goal(stage, boundary, surface, picks)
        nodes, cell = gather(nodes, self.stencils.index), self.stencils.cell
        jacobian = stencil_jacobian(nodes, cell)
        det = determinant(jacobian)
        corners = surface.view(-1, 3, 3)
        normals = triangle_normals(corners)
        wrong_side = _INWARD_NORMALS if stage.target == "cube" else 0.0
        terms = {
            "bij": bijectivity(det),
            "arap": distortion(jacobian, det),
            "fair": fairness(nodes, cell),
            "dist": distance(surface, goal),
            "norm": normal_difference(normals, triangle_normals(goal.view(-1, 3, 3)), wrong_side),
            "star": star_shape(corners, normals),
        } | self._held_terms(boundary, held)
        weights = {name: getattr(stage.weights, name) for name in terms}
        if "cor" in terms:
            weights["cor"] = stage.weights.cor or _GIVEN_CORNERS
        total = torch.stack([weights[name] * term for name, term in terms.items()]).sum()
        return total, int((det <= 0.0).sum()), {name: float(term.detach()) for name, term in terms.items()}

    def _goal(self, stage: Stage, boundary: BoundaryData, surface: Tensor, picks: Tensor) -> Tensor:
        """Return the goals (3 t, 3) of the corners of the mapped triangles `picks` (t,).

        Once the surface is cut, each triangle goes to its own face of the cube.
        """
        with torch.no_grad():
            if boundary.labels is None:
                return nearest(stage.target, surface)
            return nearest_on_cube_face(surface, boundary.labels[picks].repeat_interleave(3))

    def _held_terms(self, boundary: BoundaryData, held: list[Tensor]) -> dict[str, Tensor]:
        """Return the terms of L_bound for the held vertices: the mapped corners (8, 3), then the path points (k, 3)."""
        terms = {}
        if boundary.corners is not None:
            terms["cor"] = distance(held[0], torch.as_tensor(CORNERS).to(held[0]))
        if boundary.paths is not None:
            terms["edge"] = edge_path(held[1], boundary.paths.targets, boundary.paths.following)
        return terms


def _neighbour(mapped: Tensor, step: IntArray) -> Tensor:
    """Return the mapped stencil points (r, 3) at a lattice step from the centres."""
    return mapped[:, _POSITION[tuple(step.tolist())]]


def stencil_jacobian(mapped: Tensor, cell: float) -> Tensor:
    """Return J (3, 3, r) by central differences of G at stencils (r, 19, 3); the second index of J is the direction."""
    columns = [(_neighbour(mapped, e) - _neighbour(mapped, -e)).T for e in _UNITS]
    return torch.stack(columns, dim=1) / (2.0 * cell)


def bijectivity(det: Tensor) -> Tensor:
    """Return L_bij of eq. (3) as the mean of (alpha - det)_+^2.

    The paper has no square; the square keeps the gradient continuous where a fold opens.
    """
    return (_ALPHA - det).clamp_min(0.0).square().mean()


def distortion(jacobian: Tensor, det: Tensor) -> Tensor:
    """Return L_arap of eq. (3): the mean of det * sum (1 / sigma - 1)^2, the ARAP energy of the inverse of G.

    With A = J^-1 and R its closest rotation this is det * |A - R|^2. Determinants below _LEAST_DET count as _LEAST_DET.
    """
    safe = det.clamp_min(_LEAST_DET)
    inverse = cofactor(jacobian).transpose(0, 1) / safe
    return (safe * (inverse - closest_rotation(inverse)).square().sum(dim=(0, 1))).mean()


def fairness(mapped: Tensor, cell: float) -> Tensor:
    """Return L_fair of eq. (3): the mean of the squared Frobenius norms of the three Hessians of G."""
    total = mapped.new_zeros(())
    centre = mapped[:, 0]
    for a in range(3):
        ea = _UNITS[a]
        second = (_neighbour(mapped, ea) - 2.0 * centre + _neighbour(mapped, -ea)) / cell**2
        total = total + second.square().sum(dim=1).mean()
        for b in range(a + 1, 3):
            eb = _UNITS[b]
            mixed = (
                _neighbour(mapped, ea + eb)
                - _neighbour(mapped, ea - eb)
                - _neighbour(mapped, eb - ea)
                + _neighbour(mapped, -ea - eb)
            ) / (4.0 * cell**2)
            total = total + 2.0 * mixed.square().sum(dim=1).mean()
    return total


def distance(mapped: Tensor, target: Tensor) -> Tensor:
    """Return the mean squared distance of points (m, 3), which is L_dist and L_cor of eq. (3)."""
    return (mapped - target).square().sum(dim=1).mean()


def triangle_normals(corners: Tensor) -> Tensor:
    """Return the unit normals (m, 3) of triangles (m, 3, 3), last index the coordinate; 0 where the area is 0."""
    cross = torch.linalg.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return cross / cross.norm(dim=1, keepdim=True).clamp_min(1e-12)


def normal_difference(normals: Tensor, target: Tensor, wrong_side: float) -> Tensor:
    """Return L_norm of eq. (3), the mean squared difference of unit normals, plus a term that the paper does not have.

    The additional term is `wrong_side` times the mean of (-<n, n_target>)_+: at opposite normals the first term is
    stationary.
    """
    opposed = (-(normals * target).sum(dim=1)).clamp_min(0.0).mean()
    return (normals - target).square().sum(dim=1).mean() + wrong_side * opposed


def star_shape(corners: Tensor, normals: Tensor) -> Tensor:
    """Return L_star of eq. (3): the mean of (-<A v, n> / |A v|)_+^2, A the cube's centre, v a corner of the triangle.

    By the paper's Lemma 1 the term is 0 only where the mapped surface is star-shaped. The paper writes it without
    (.)_+^2.
    """
    arm = corners[:, 0] - 0.5
    facing = (arm * normals).sum(dim=1) / arm.norm(dim=1).clamp_min(1e-12)
    return (-facing).clamp_min(0.0).square().mean()


def edge_path(mapped: Tensor, target: Tensor, following: Tensor) -> Tensor:
    """Return L_edge of eq. (3) from the mapped points (k, 3) of paths and their targets (k, 3) on the cube's edges.

    L_edge is the mean squared distance of the points from their targets, plus that of the paths' directions from the
    edges' directions. following: (s, 2), pairs of consecutive path points.
    """
    step = gather(mapped, following[:, 1]) - gather(mapped, following[:, 0])
    aim = target[following[:, 1]] - target[following[:, 0]]
    direction = step / step.norm(dim=1, keepdim=True).clamp_min(1e-12)
    aim = aim / aim.norm(dim=1, keepdim=True).clamp_min(1e-12)
    return distance(mapped, target) + _DIRECTIONS * (direction - aim).square().sum(dim=1).mean()


def determinant(j: Tensor) -> Tensor:
    """Return the determinants (m,) of matrices (3, 3, m)."""
    return (j[:1] * _cross(j[1:2], j[2:])).sum(dim=(0, 1))


def cofactor(j: Tensor) -> Tensor:
    """Return the cofactors (3, 3, m) of matrices J (3, 3, m): the inverse of J is the transpose over det J."""
    cyclic = torch.cat([j, j[:2]])
    return _cross(cyclic[1:4], cyclic[2:5])


def _cross(a: Tensor, b: Tensor) -> Tensor:
    """Return the cross products of rows (k, 3, m), row by row; slices along the samples are fast."""
    a, b = torch.cat([a, a[:, :2]], dim=1), torch.cat([b, b[:, :2]], dim=1)  # (k, 5, m)
    return torch.addcmul(a[:, 1:4] * b[:, 2:5], a[:, 2:5], b[:, 1:4], value=-1.0)


def closest_rotation(j: Tensor) -> Tensor:
    """Return the rotation closest to each matrix of (3, 3, m), without a gradient: see `closest_rotations`."""
    return torch.from_numpy(closest_rotations(j.detach().cpu().numpy())).to(j.device)
