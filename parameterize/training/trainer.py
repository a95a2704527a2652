"""The training stages as one loop: smooth cuboids S(2), S(1), cube, fixed corners, fixed edges (section 4.3.1)."""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from ..arrays import Array, IntArray
from ..checkpoint import Checkpoints
from ..config import Config, StageConfig
from ..cube.cube import CORNERS
from ..cube.edge_paths import CubeSurface, PathError, choose_corners, cut_surface, edge_targets
from ..history import History
from ..progress import Progress, ProgressCallback, ignore
from . import losses
from .network import InverseMap
from .samples import Stencils, TriangleSampler, gather, interior_points, stencils
from .target_shapes import nearest, nearest_on_cube_face

_log = logging.getLogger(__name__)
State = dict[str, Tensor]
_CHECKPOINT, _CHECKPOINT_STEPS = "training", 100


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
class _Run:
    """Where the training stands within a stage; what a checkpoint holds beside the network and the optimiser."""

    number: int
    step: int
    start: State  # the network at the start of the stage: corners and cuts were taken from it
    best: State
    best_key: tuple[float, float] = (math.inf, math.inf)  # folded samples, then loss


class Trainer:
    """Trains G on one surface.

    vertices (n, 3) at volume 1, faces (m, 3); given_corners (8,) vertex numbers or None; start: see start_map.
    The random numbers of a step depend on the seed, the stage and the step alone.
    """

    def __init__(
        self,
        vertices: Array,
        faces: IntArray,
        config: Config,
        *,
        seed: int,
        start: int = 0,
        device: torch.device,
        dtype: torch.dtype = torch.float32,
        given_corners: IntArray | None = None,
        history: History | None = None,
        progress: ProgressCallback = ignore,
        checkpoints: Checkpoints | None = None,
    ) -> None:
        torch.manual_seed(seed % 2**63)
        self.config, self.seed, self.device, self.dtype = config, seed, device, dtype
        self.vertices, self.faces = vertices, faces
        self.corners = given_corners
        self.network = InverseMap(config.network).to(device=device, dtype=dtype)
        if config.train.whiten:
            first = start_map(interior_points(vertices, faces, config.train.cell), start)
            self.network.affine.copy_(self._tensor(first))
        self.stencils: Stencils = stencils(vertices, faces, config.train.cell, device=device, dtype=dtype)
        self.history = history if history is not None else History()
        self.progress = progress
        self.checkpoints = checkpoints or Checkpoints(None, {}, resume=False)
        self.generator = torch.Generator()
        self._corner_targets = self._tensor(CORNERS)

    def run(self) -> InverseMap:
        """All stages, or those that a checkpoint leaves; the network at the best state of the last one.

        Where the mapped surface is still too far from a cube for its edges to be traced, the stages that fix them are
        left out and a warning says so: the spline stage moves edges anyway. Raises PathError where the user gave the
        corners.
        """
        given = self.corners is not None
        saved = self.checkpoints.load(_CHECKPOINT)
        first = 0 if saved is None else int(saved[1]["number"])
        for number in range(first, len(self.config.stages)):
            stage = self.config.stages[number]
            run = _Run(number, 0, self._state(), self._state())
            if saved is not None and number == first:
                run = self._load_run(*saved)
            try:
                boundary = self._prepare(stage)
            except PathError as error:
                if given:
                    raise
                _log.warning("training ends before stage %s: %s", stage.name, error)
                break
            optimizer = torch.optim.Adam(self.network.parameters(), lr=self.config.train.learning_rate)
            if saved is not None and number == first:
                self._load_progress(saved[0], optimizer)
            self._train(run, boundary, optimizer)
        return self.network

    def map(self, points: Array) -> Array:
        """G at points (m, 3), as float64."""
        return map_points(self.network, points, self.device, self.dtype)

    def mapped(self) -> Array:
        """G at the surface's vertices (n, 3), as the network is now."""
        return self.map(self.vertices)

    def _prepare(self, stage: StageConfig) -> BoundarySamples:
        """Choose corners and cut the surface, where the stage asks for it, by the network as it is."""
        if stage.weights.cor > 0.0 and self.corners is None:
            self.corners = choose_corners(self.map(self.vertices))
        if stage.weights.edge == 0.0:
            return self._boundary(self.vertices, self.faces, self.corners)
        assert self.corners is not None
        return self._cut_boundary(cut_surface(self.map(self.vertices), self.faces, self.corners))

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

    def _train(self, run: _Run, boundary: BoundarySamples, optimizer: torch.optim.Adam) -> None:
        """One stage; ends with the network at its best state (fewest folded samples, then lowest loss)."""
        stage = self.config.stages[run.number]
        later = sum(s.steps for s in self.config.stages[run.number + 1 :])
        started, begun = time.perf_counter(), run.step
        try:
            while run.step < stage.steps:
                self._step(run, stage, boundary, optimizer)
                pace = (time.perf_counter() - started) / (run.step - begun)
                _, _, loss, folded, _ = self.history.rows[-1]
                left = pace * (stage.steps - run.step + later)
                self.progress(Progress(stage.name, run.step, stage.steps, loss, folded, left, self.mapped))
                if run.step % _CHECKPOINT_STEPS == 0 or run.step == stage.steps:
                    self._save(run, optimizer)
        except KeyboardInterrupt:
            self._save(run, optimizer)
            raise
        self.network.load_state_dict(run.best)

    def _step(self, run: _Run, stage: StageConfig, boundary: BoundarySamples, optimizer: torch.optim.Adam) -> None:
        """One Adam step; nothing of the state changes before the loss is known."""
        self.generator.manual_seed((1_000_003 * self.seed + 100_003 * run.number + run.step) % 2**63)
        optimizer.zero_grad(set_to_none=True)
        loss, folded, terms = self._loss(stage, boundary)
        loss.backward()  # type: ignore[no-untyped-call]
        value = float(loss.detach())
        if not math.isfinite(value):
            raise FloatingPointError(f"stage {stage.name}, step {run.step}: the loss is not finite")
        if (folded, value) < run.best_key:
            run.best_key, run.best = (folded, value), self._state()
        for group in optimizer.param_groups:
            group["lr"] = self._learning_rate(run.step, stage.steps)
        optimizer.step()
        self.history.add(stage.name, run.step, value, folded, terms)
        run.step += 1

    def _state(self) -> State:
        return {name: value.clone() for name, value in self.network.state_dict().items()}

    def _save(self, run: _Run, optimizer: torch.optim.Adam) -> None:
        parts = {"now": self.network.state_dict(), "start": run.start, "best": run.best}
        tensors = {f"{part}.{name}": value for part, state in parts.items() for name, value in state.items()}
        for index, moments in optimizer.state_dict()["state"].items():
            tensors |= {f"adam.{index}.{name}": value for name, value in moments.items()}
        state = {
            "number": run.number,
            "step": run.step,
            "best_key": run.best_key,
            "corners": None if self.corners is None else self.corners.tolist(),
            "history": self.history.rows,
        }
        self.checkpoints.save(_CHECKPOINT, tensors, state)

    def _load_run(self, tensors: State, state: dict[str, Any]) -> _Run:
        """Bring back everything but network and optimiser as they were; the network is left at the stage's start."""
        self.corners = None if state["corners"] is None else np.array(state["corners"])
        self.history.rows[:] = [tuple(row) for row in state["history"]]
        start, best = _part(tensors, "start"), _part(tensors, "best")
        self.network.load_state_dict(start)
        folded, loss = state["best_key"]
        return _Run(state["number"], state["step"], start, best, (folded, loss))

    def _load_progress(self, tensors: State, optimizer: torch.optim.Adam) -> None:
        self.network.load_state_dict(_part(tensors, "now"))
        moments: dict[int, State] = {}
        for key, value in _part(tensors, "adam").items():
            index, name = key.split(".")
            moments.setdefault(int(index), {})[name] = value
        optimizer.load_state_dict({"state": moments, "param_groups": optimizer.state_dict()["param_groups"]})

    def _learning_rate(self, step: int, steps: int) -> float:
        """Cosine decay from the first to the final learning rate."""
        first, last = self.config.train.learning_rate, self.config.train.final_learning_rate
        return last + 0.5 * (first - last) * (1.0 + math.cos(math.pi * step / steps))

    def _loss(self, stage: StageConfig, boundary: BoundarySamples) -> tuple[Tensor, int, dict[str, float]]:
        """Return the weighted sum of the terms (eq. (2) and (3)), the folded stencils, and the unweighted terms."""
        picks = boundary.sampler.draw(self.generator)
        used, place = torch.unique(boundary.faces[picks].flatten(), return_inverse=True)
        points = [self.stencils.shifted(self.generator), boundary.vertices[used]]
        points += [boundary.vertices[index] for index in (boundary.corners, boundary.path) if index is not None]
        nodes, surface, *held = self.network(torch.cat(points)).split([len(p) for p in points])
        terms, folded = self._interior_terms(gather(nodes, self.stencils.index))
        terms |= self._surface_terms(stage, boundary, gather(surface, place), picks)
        terms |= self._held_terms(boundary, held)
        weights = {name: getattr(stage.weights, name) for name in terms}
        if "cor" in terms:
            weights["cor"] = stage.weights.cor or stage.given_corner_weight
        total = torch.stack([weights[name] * term for name, term in terms.items()]).sum()
        return total, folded, {name: float(term.detach()) for name, term in terms.items()}

    def _interior_terms(self, nodes: Tensor) -> tuple[dict[str, Tensor], int]:
        """Return the terms of L_inner (section 4.4.2) on mapped stencils (r, 19, 3), and the number folded."""
        cell, alpha = self.stencils.cell, self.config.train.min_det
        jacobian = losses.stencil_jacobian(nodes, cell)
        det = losses.determinant(jacobian)
        terms = {
            "bij": losses.bijectivity(det, alpha),
            "arap": losses.distortion(jacobian, det, alpha / 2.0),
            "fair": losses.fairness(nodes, cell),
        }
        return terms, losses.folded(det)

    def _surface_terms(
        self, stage: StageConfig, boundary: BoundarySamples, surface: Tensor, picks: Tensor
    ) -> dict[str, Tensor]:
        """Return the terms of L_bound (section 4.4.1) on the corners (3 t, 3) of the mapped triangles `picks` (t,)."""
        goal = self._goal(stage, boundary, surface, picks)
        normals = losses.triangle_normals(surface.view(-1, 3, 3))
        goal_normals = losses.triangle_normals(goal.view(-1, 3, 3))
        wrong_side = self.config.train.wrong_side if stage.target == "cube" else 0.0
        return {
            "dist": losses.distance(surface, goal),
            "norm": losses.normal_difference(normals, goal_normals, wrong_side),
            "star": losses.star_shape(surface.view(-1, 3, 3), normals),
        }

    def _held_terms(self, boundary: BoundarySamples, held: list[Tensor]) -> dict[str, Tensor]:
        """Return the terms of L_bound for what is held: the mapped corners (8, 3), then the path points (k, 3)."""
        terms = {}
        if boundary.corners is not None:
            terms["cor"] = losses.distance(held[0], self._corner_targets)
        if boundary.path is not None and boundary.path_target is not None and boundary.path_following is not None:
            terms["edge"] = losses.edge_path(held[1], boundary.path_target, boundary.path_following)
        return terms

    @torch.no_grad()
    def _goal(self, stage: StageConfig, boundary: BoundarySamples, surface: Tensor, picks: Tensor) -> Tensor:
        """Nearest points of the target shape, on each triangle's own cube face once the surface is cut."""
        if boundary.labels is None:
            return nearest(stage.target, surface)
        return nearest_on_cube_face(surface, boundary.labels[picks].repeat_interleave(3))


def start_map(points: Array, start: int) -> Array:
    """Linear map (3, 3) of determinant 1 that makes a cloud of points (m, 3) as wide in all directions.

    Symmetric for start 0; for the others the cloud is then turned by 45 degrees about the axes y, z and x in turn,
    which leads the cube's edges over other parts of the surface.
    """
    values, vectors = np.linalg.eigh(np.cov(points.T))
    whitening = (vectors * np.sqrt(values.prod() ** (1.0 / 3.0) / values)) @ vectors.T
    turn = Rotation.from_rotvec(np.pi / 4.0 * np.eye(3)[start % 3] * (start > 0))
    return np.asarray(turn.as_matrix() @ whitening)


def _part(tensors: State, prefix: str) -> State:
    """The entries named `prefix`.something, under that something."""
    return {key.removeprefix(f"{prefix}."): value for key, value in tensors.items() if key.startswith(f"{prefix}.")}


@torch.no_grad()
def map_points(
    network: InverseMap, points: Array, device: torch.device, dtype: torch.dtype, block: int = 65_536
) -> Array:
    """G at points (m, 3) in blocks, as float64."""
    pieces = torch.as_tensor(points, dtype=dtype, device=device)
    return np.asarray(torch.cat([network(piece) for piece in torch.split(pieces, block)]).double().cpu())
