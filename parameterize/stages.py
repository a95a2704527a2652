"""The four training stages as one loop: smooth cuboids S(2) and S(1), cube, fixed corners, fixed edges (section 4.3.1)."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from . import losses
from .bspline import Array
from .config import Config, StageConfig
from .corners import CORNERS, CubeSurface, choose_corners, cut_surface, edge_targets
from .cutting import IntArray
from .network import InverseMap
from .progress import Progress, ProgressCallback, ignore
from .sample import Stencils, TriangleSampler, stencils
from .targets import nearest, nearest_on_cube_face

_log = logging.getLogger(__name__)
TERMS = ("bij", "arap", "fair", "dist", "norm", "star", "cor", "edge")


@dataclass(frozen=True, eq=False)
class BoundarySamples:
    """What a stage knows of the surface: its triangles, and from the later stages corners, edges and cube faces."""

    vertices: Tensor  # (n, 3), volume 1
    faces: Tensor  # (m, 3)
    sampler: TriangleSampler
    labels: Tensor | None = None  # (m,) cube face of each triangle, once the surface is cut
    corners: Tensor | None = None  # (8,) vertices
    path: Tensor | None = None  # (k,) vertices on the edge paths
    path_target: Tensor | None = None  # (k, 3)
    path_following: Tensor | None = None  # (s, 2)


@dataclass
class History:
    """Loss, folded samples and unweighted terms of every step, over all stages."""

    rows: list[tuple[str, int, float, int, dict[str, float]]] = field(default_factory=list)

    def add(self, stage: str, step: int, loss: float, folded: int, terms: dict[str, float]) -> None:
        self.rows.append((stage, step, loss, folded, terms))

    def arrays(self) -> dict[str, np.ndarray]:
        """Columns of equal length; NaN where a term is not used."""
        names = sorted({name for row in self.rows for name in row[4]})
        columns: dict[str, np.ndarray] = {
            "stage": np.array([row[0] for row in self.rows]),
            "step": np.array([row[1] for row in self.rows]),
            "loss": np.array([row[2] for row in self.rows]),
            "folded": np.array([row[3] for row in self.rows]),
        }
        for name in names:
            columns[name] = np.array([row[4].get(name, math.nan) for row in self.rows])
        return columns


@dataclass(frozen=True, eq=False)
class Trained:
    """The network after its last stage (best state), and the surface cut along the cube's edges."""

    network: InverseMap
    surface: CubeSurface


class Trainer:
    """Trains G on one surface.

    vertices (n, 3) at volume 1, faces (m, 3); given_corners (8,) vertex numbers or None.
    The random numbers of a step depend on the seed and the step alone.
    """

    def __init__(
        self,
        vertices: Array,
        faces: IntArray,
        config: Config,
        *,
        seed: int,
        device: torch.device,
        dtype: torch.dtype = torch.float32,
        given_corners: IntArray | None = None,
        history: History | None = None,
        progress: ProgressCallback = ignore,
    ) -> None:
        torch.manual_seed(seed)
        self.config, self.seed, self.device, self.dtype = config, seed, device, dtype
        self.vertices, self.faces = vertices, faces
        self.given_corners = given_corners
        self.network = InverseMap(config.network).to(device=device, dtype=dtype)
        self.stencils: Stencils = stencils(vertices, faces, config.train.cell, device=device, dtype=dtype)
        self.history = history if history is not None else History()
        self.progress = progress
        self.generator = torch.Generator()

    def run(self) -> Trained:
        """All stages. Raises PathError where the cube's edges cannot be traced after the third."""
        corners, surface = self.given_corners, None
        boundary = self._boundary(self.vertices, self.faces, corners=corners)
        for number, stage in enumerate(self.config.stages):
            if stage.weights.cor > 0.0 and corners is None:
                corners = choose_corners(self.map(self.vertices))
                boundary = self._boundary(self.vertices, self.faces, corners=corners)
            if stage.weights.edge > 0.0:
                assert corners is not None
                surface = cut_surface(self.map(self.vertices), self.faces, corners)
                boundary = self._cut_boundary(surface)
            self._train(number, stage, boundary)
        if surface is None:
            raise ValueError("the last stage must fix the cube's edges (weight edge > 0)")
        return Trained(self.network, surface)

    @torch.no_grad()
    def map(self, points: Array, block: int = 65_536) -> Array:
        """G at points (m, 3), as float64."""
        return map_points(self.network, points, self.device, self.dtype, block)

    def _boundary(self, vertices: Array, faces: IntArray, corners: IntArray | None) -> BoundarySamples:
        return BoundarySamples(
            self._tensor(vertices),
            torch.as_tensor(faces, device=self.device),
            TriangleSampler(vertices, faces, self.config.train.triangles, self.device),
            corners=None if corners is None else torch.as_tensor(corners, device=self.device),
        )

    def _cut_boundary(self, surface: CubeSurface) -> BoundarySamples:
        vertices = surface.cut.carry(self.vertices)
        path, target, following = edge_targets(self.map(vertices), surface.paths)
        plain = self._boundary(vertices, surface.cut.faces, surface.corners)
        return BoundarySamples(
            plain.vertices,
            plain.faces,
            plain.sampler,
            labels=torch.as_tensor(surface.face_labels, device=self.device),
            corners=plain.corners,
            path=torch.as_tensor(path, device=self.device),
            path_target=self._tensor(target),
            path_following=torch.as_tensor(following, device=self.device),
        )

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, dtype=self.dtype, device=self.device)

    def _train(self, number: int, stage: StageConfig, boundary: BoundarySamples) -> None:
        """One stage; ends with the network at its best state (fewest folded samples, then lowest loss)."""
        optimizer = torch.optim.Adam(self.network.parameters(), lr=self.config.train.learning_rate)
        best_key, best_state = (math.inf, math.inf), self._state()
        started = time.perf_counter()
        for step, rate in enumerate(self._learning_rates(stage.steps)):
            self.generator.manual_seed(1_000_003 * self.seed + 100_003 * number + step)
            for group in optimizer.param_groups:
                group["lr"] = rate
            optimizer.zero_grad(set_to_none=True)
            loss, folded, terms = self._loss(stage, boundary)
            loss.backward()  # type: ignore[no-untyped-call]
            value = float(loss.detach())
            if not math.isfinite(value):
                raise FloatingPointError(f"stage {stage.name}, step {step}: the loss is not finite")
            if (folded, value) < best_key:
                best_key, best_state = (folded, value), self._state()
            optimizer.step()
            self.history.add(stage.name, step, value, folded, terms)
            pace = (time.perf_counter() - started) / (step + 1)
            later = sum(s.steps for s in self.config.stages[number + 1 :])
            left = pace * (stage.steps - step - 1 + later)
            self.progress(Progress(stage.name, step + 1, stage.steps, value, folded, left))
        self.network.load_state_dict(best_state)

    def _state(self) -> dict[str, Tensor]:
        return {name: value.clone() for name, value in self.network.state_dict().items()}

    def _learning_rates(self, steps: int) -> Iterator[float]:
        """Cosine decay from the first to the final learning rate."""
        first, last = self.config.train.learning_rate, self.config.train.final_learning_rate
        for step in range(steps):
            yield last + 0.5 * (first - last) * (1.0 + math.cos(math.pi * step / steps))

    def _loss(self, stage: StageConfig, boundary: BoundarySamples) -> tuple[Tensor, int, dict[str, float]]:
        """Weighted sum (eq. 2 and 3), folded stencils, and the unweighted terms in use."""
        train, weights = self.config.train, stage.weights
        picks = boundary.sampler.draw(self.generator)
        parts = [self.stencils.shifted(self.generator), boundary.vertices[boundary.faces[picks]].reshape(-1, 3)]
        parts += [boundary.vertices[index] for index in (boundary.corners, boundary.path) if index is not None]
        mapped = list(self.network(torch.cat(parts)).split([len(p) for p in parts]))
        nodes, surface = mapped[0][self.stencils.index], mapped[1]  # (r, 19, 3), (3 t, 3)

        jacobian = losses.stencil_jacobian(nodes, self.stencils.cell)
        det = losses.determinant(jacobian)
        goal = self._goal(stage, boundary, surface, picks)
        normals = losses.triangle_normals(surface.view(-1, 3, 3))
        goal_normals = losses.triangle_normals(goal.view(-1, 3, 3))
        wrong_side = train.wrong_side if stage.target == "cube" else 0.0
        terms = {
            "bij": losses.bijectivity(det, train.min_det),
            "arap": losses.distortion(jacobian, det, train.min_det / 2.0),
            "fair": losses.fairness(nodes, self.stencils.cell),
            "dist": losses.distance(surface, goal),
            "norm": losses.normal_difference(normals, goal_normals, wrong_side),
            "star": losses.star_shape(surface.view(-1, 3, 3), normals),
        }
        weight = {name: getattr(weights, name) for name in TERMS}
        if boundary.corners is not None:
            terms["cor"] = losses.distance(mapped[2], self._tensor(CORNERS))
            weight["cor"] = weights.cor or stage.given_corner_weight
        if boundary.path is not None and boundary.path_target is not None and boundary.path_following is not None:
            terms["edge"] = losses.edge_path(mapped[3], boundary.path_target, boundary.path_following)
        total = torch.stack([weight[name] * term for name, term in terms.items()]).sum()
        return total, losses.folded(det), {name: float(term.detach()) for name, term in terms.items()}

    @torch.no_grad()
    def _goal(self, stage: StageConfig, boundary: BoundarySamples, surface: Tensor, picks: Tensor) -> Tensor:
        """Nearest points of the target shape, on each triangle's own cube face once the surface is cut."""
        if boundary.labels is None:
            return nearest(stage.target, surface)
        return nearest_on_cube_face(surface, boundary.labels[picks].repeat_interleave(3))


@torch.no_grad()
def map_points(
    network: InverseMap, points: Array, device: torch.device, dtype: torch.dtype, block: int = 65_536
) -> Array:
    """G at points (m, 3) in blocks, as float64."""
    blocks = [network(torch.as_tensor(p, dtype=dtype, device=device)) for p in np.array_split(points, -(-len(points) // block))]
    return np.asarray(torch.cat(blocks).double().cpu())
