"""Computes the training loss L = L_inner + L_bound (paper, eq. (2) and (3)): its weighted sum, and one function a term.

Each term has the name of its weight in `StageWeights`, and returns its value and its slopes. The paper gives the
formulas of the terms without numbers: those of L_bound in section 4.4.1, those of L_inner in 4.4.2.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Array, IntArray
from ..config import StageName
from ..cube.cube import CORNERS
from ..quality.rotations import closest_rotations, cofactors_and_determinants, squared_norms
from .network import InverseMap, Parameters
from .target_shapes import nearest, nearest_on_cube_face
from .training_points import Stencils, TriangleSampler

Target = Literal["S(2)", "S(1)", "cube"]
Term = tuple[float, Array]  # the value, and its slopes in what the term is computed from


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
_TINY = 1e-12  # lengths below this count as this


@dataclass(frozen=True, eq=False)
class EdgePaths:
    """Hold the paths that go to the cube's edges: vertices (k,), targets (k, 3), pairs of neighbours (s, 2)."""

    vertices: IntArray
    targets: Array
    following: IntArray


@dataclass(frozen=True, eq=False)
class BoundaryData:
    """Hold the surface data of a stage: vertices (n, 3) at volume 1, triangles (m, 3), the sampler of the triangles.

    Later stages also have corners (8,), the vertices that go to the cube's corners; labels (m,), the cube face of each
    triangle; and the paths to the cube's edges.
    """

    vertices: Array
    faces: IntArray
    sampler: TriangleSampler
    corners: IntArray | None = None
    labels: IntArray | None = None
    paths: EdgePaths | None = None


@dataclass(frozen=True, eq=False)
class Loss:
    """Hold the weighted sum of the terms, the number of folded stencils, the terms, the slopes in the parameters."""

    value: float
    folded: int
    terms: dict[str, float]
    gradient: Callable[[], Parameters]


@dataclass(frozen=True, eq=False)
class Objective:
    """Compute the loss of every stage from the network's values at stencils inside the domain and on the surface."""

    network: InverseMap
    stencils: Stencils

    def __call__(self, stage: Stage, boundary: BoundaryData, generator: np.random.Generator) -> Loss:
        """Return the weighted sum of the terms (eq. (2), (3)) at random samples."""
        picks = boundary.sampler.draw(generator)
        used, place = np.unique(boundary.faces[picks], return_inverse=True)
        corners, paths = boundary.corners, boundary.paths
        held = [] if corners is None else [corners]
        held += [] if paths is None else [paths.vertices]
        points = [self.stencils.shifted(generator), *(boundary.vertices[index] for index in (used, *held))]
        mapped, pulled_back = self.network.with_gradient(np.concatenate(points))
        nodes, surface, *ends = np.split(mapped, np.cumsum([len(part) for part in points])[:-1])
        triangles = surface[place].reshape(-1, 3, 3)
        derivatives = (self.stencils.differences @ nodes).reshape(9, -1, 3)
        jacobian = np.moveaxis(derivatives[:3], 2, 0)
        inner, folded = inner_terms(jacobian, derivatives[3:])
        wrong_side = _INWARD_NORMALS if stage.target == "cube" else 0.0
        bound = bound_terms(triangles, _goal(stage, boundary, triangles, picks), wrong_side)
        on_corners = {} if corners is None else {"cor": distance(ends[0], CORNERS)}
        on_paths = {} if paths is None else {"edge": edge_path(ends[-1], paths.targets, paths.following)}
        parts = [inner, bound, *filter(None, [on_corners, on_paths])]
        weights = vars(stage.weights) | {"cor": stage.weights.cor or _GIVEN_CORNERS}

        def gradient() -> Parameters:
            in_nodes, in_triangles, *in_ends = (
                sum(weights[name] * slopes for name, (_, slopes) in part.items()) for part in parts
            )
            in_nodes = self.stencils.differences.T @ in_nodes.reshape(-1, 3)
            in_surface = np.stack([np.bincount(place.ravel(), s, len(used)) for s in in_triangles.reshape(-1, 3).T], 1)
            return pulled_back(np.concatenate([in_nodes, in_surface, *in_ends]))

        terms = {name: value for part in parts for name, (value, _) in part.items()}
        return Loss(sum(weights[name] * value for name, value in terms.items()), folded, terms, gradient)


def _goal(stage: Stage, boundary: BoundaryData, triangles: Array, picks: IntArray) -> Array:
    """Return the goals (t, 3, 3) of the corners of the mapped triangles `picks` (t,).

    Once the surface is cut, each triangle goes to its own face of the cube.
    """
    corners = triangles.reshape(-1, 3)
    if boundary.labels is None:
        return nearest(stage.target, corners).reshape(-1, 3, 3)
    return nearest_on_cube_face(corners, boundary.labels[picks].repeat(3)).reshape(-1, 3, 3)


def inner_terms(jacobian: Array, second: Array) -> tuple[dict[str, Term], int]:
    """Return the terms of L_inner, with slopes in the derivatives (9, r, 3), and the number of folded stencils.

    jacobian: (3, 3, r), its second index the direction. second: (6, r, 3).
    """
    jacobian = np.ascontiguousarray(jacobian)
    cofactors, det = cofactors_and_determinants(jacobian)
    bij, of_bij = bijectivity(det)
    arap, of_arap = distortion(jacobian, cofactors, det)
    fair, of_fair = fairness(second)
    none, no_first = np.zeros_like(second), np.zeros((3, *second.shape[1:]))
    terms = {
        "bij": (bij, np.concatenate([np.moveaxis(of_bij * cofactors, 0, 2), none])),
        "arap": (arap, np.concatenate([np.moveaxis(of_arap, 0, 2), none])),
        "fair": (fair, np.concatenate([no_first, of_fair])),
    }
    return terms, int((det <= 0.0).sum())


def bound_terms(triangles: Array, goal: Array, wrong_side: float) -> dict[str, Term]:
    """Return the terms of L_bound of mapped triangles and their goals (t, 3, 3), with slopes in the triangles."""
    normals, of_normals = triangle_normals(triangles)
    norm, in_normals = normal_difference(normals, triangle_normals(goal)[0], wrong_side)
    star, in_arms, star_normals = star_shape(triangles[:, 0] - 0.5, normals)
    in_star = of_normals(star_normals)
    in_star[:, 0] += in_arms
    return {
        "dist": distance(triangles, goal),
        "norm": (norm, of_normals(in_normals)),
        "star": (star, in_star),
    }


def bijectivity(det: Array) -> Term:
    """Return L_bij of eq. (3) as the mean of (alpha - det)_+^2, with slopes in det.

    The paper has no square; the square keeps the gradient continuous where a fold opens.
    """
    gap = (_ALPHA - det).clip(min=0.0)
    return float((gap**2).mean()), -2.0 / len(det) * gap


def distortion(jacobian: Array, cofactors: Array, det: Array) -> Term:
    """Return L_arap of eq. (3): the mean of det * sum (1 / sigma - 1)^2, the ARAP energy of the inverse of G.

    With A = J^-T and R its closest rotation this is det * |A - R|^2. Determinants below _LEAST_DET count as _LEAST_DET.
    The slopes are those in J (3, 3, r). R is held: the distance is stationary in it.
    """
    safe = det.clip(min=_LEAST_DET)
    inverse = cofactors / safe
    excess = inverse - closest_rotations(inverse)
    squares = squared_norms(excess)
    in_det = np.where(det > _LEAST_DET, squares - 2.0 * (excess * inverse).sum(axis=(0, 1)), 0.0)
    slopes = in_det * cofactors + _in_matrix(jacobian, cofactors, 2.0 * excess)
    return float((safe * squares).mean()), slopes / len(det)


def _in_matrix(jacobian: Array, cofactors: Array, slopes: Array) -> Array:
    """Return slopes in matrices J (3, 3, r), from those in the cofactors of J, which are quadratic in J."""
    both, _ = cofactors_and_determinants(jacobian + slopes)
    own, _ = cofactors_and_determinants(slopes)
    return np.asarray(both - own - cofactors)


def fairness(second: Array) -> Term:
    """Return L_fair of eq. (3): the mean of the squared Frobenius norms of the three Hessians of G.

    second: (6, r, 3), the pure second derivatives, then the mixed ones, which count twice.
    """
    weighted = second * np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])[:, None, None]
    count = second.shape[1]
    return float((weighted * second).sum() / count), 2.0 / count * weighted


def distance(mapped: Array, target: Array) -> Term:
    """Return the mean squared distance of points (.., 3), which is L_dist and L_cor of eq. (3)."""
    away = mapped - target
    count = away.size // 3
    return float((away**2).sum() / count), 2.0 / count * away


def triangle_normals(corners: Array) -> tuple[Array, Callable[[Array], Array]]:
    """Return the unit normals (m, 3) of triangles (m, 3, 3), last index the coordinate; 0 where the area is 0.

    Also return what takes slopes in the normals to those in the corners.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    directions, of_directions = _directions(np.cross(a, b))

    def in_corners(slopes: Array) -> Array:
        slopes = of_directions(slopes)
        in_a, in_b = np.cross(b, slopes), np.cross(slopes, a)
        return np.stack([-in_a - in_b, in_a, in_b], axis=1)

    return directions, in_corners


def _directions(vectors: Array) -> tuple[Array, Callable[[Array], Array]]:
    """Return unit vectors (m, 3), and what takes slopes in them to those in the vectors."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True).clip(min=_TINY)
    directions = vectors / lengths

    def in_vectors(slopes: Array) -> Array:
        return np.asarray((slopes - (slopes * directions).sum(axis=1, keepdims=True) * directions) / lengths)

    return directions, in_vectors


def normal_difference(normals: Array, target: Array, wrong_side: float) -> Term:
    """Return L_norm of eq. (3), the mean squared difference of unit normals, plus a term that the paper does not have.

    The additional term is `wrong_side` times the mean of (-<n, n_target>)_+: at opposite normals the first term is
    stationary.
    """
    facing, count = (normals * target).sum(axis=1), len(normals)
    value, slopes = distance(normals, target)
    opposed = wrong_side / count * (facing < 0.0)
    return value - float((opposed * facing).sum()), slopes - opposed[:, None] * target


def star_shape(arms: Array, normals: Array) -> tuple[float, Array, Array]:
    """Return L_star of eq. (3): the mean of (-<A v, n> / |A v|)_+^2, A the cube's centre, v a corner of the triangle.

    By the paper's Lemma 1 the term is 0 only where the mapped surface is star-shaped. The paper writes it without
    (.)_+^2. Also return the slopes in the arms A v and in the normals n, (m, 3) each.
    """
    directions, of_directions = _directions(arms)
    away = (-(directions * normals).sum(axis=1, keepdims=True)).clip(min=0.0)
    slopes = -2.0 / len(arms) * away
    return float((away**2).mean()), of_directions(slopes * normals), slopes * directions


def edge_path(mapped: Array, target: Array, following: IntArray) -> Term:
    """Return L_edge of eq. (3) from the mapped points (k, 3) of paths and their targets (k, 3) on the cube's edges.

    L_edge is the mean squared distance of the points from their targets, plus that of the paths' directions from the
    edges' directions. following: (s, 2), pairs of consecutive path points.
    """
    first, second = following.T
    directions, of_directions = _directions(mapped[second] - mapped[first])
    aims, _ = _directions(target[second] - target[first])
    (value, slopes), (turned, in_directions) = distance(mapped, target), distance(directions, aims)
    in_steps = _DIRECTIONS * of_directions(in_directions)
    for ends, sign in ((first, -1.0), (second, 1.0)):
        np.add.at(slopes, ends, sign * in_steps)
    return value + _DIRECTIONS * turned, slopes
