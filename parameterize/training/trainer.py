"""Trains the network in stages: smooth cuboids S(2), S(1), cube, fixed corners, fixed edges (section 4.3.1).

The loss at the end of the first stage decides whether the network suits the shape.
"""

import logging
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array, Floats, IntArray
from ..checkpoint import Checkpoints
from ..config import Config, StageConfig
from ..cube.cube import CubeLayout
from ..cube.edge_paths import PathError, choose_corners, cut_surface, edge_targets
from ..cube.turning import best_turn, concavity
from ..progress import History, Progress, ProgressCallback
from ..surface.errors import MeshError
from ..surface.solid import Solid
from .losses import STAGES, BoundaryData, EdgePaths, Objective
from .network import InverseMap
from .optimizer import TrainingOptimizer
from .training_points import TriangleSampler, stencils

_log = logging.getLogger(__name__)
State = dict[str, Floats]
_CHECKPOINT, _CHECKPOINT_STEPS = "training", 100
_COMPARED_STEPS = 8  # the last ones of a race, whose mean scores are compared
_REST = 0.02  # share of the other terms in a race's score beside the distortion: a run may still be far from the cube
_FEWEST = 10  # points of a lattice inside: fewer do not tell how wide a body is
_TOO_THIN = "the body is too thin for the network: hardly a point of a lattice lies inside; scale its thickness up"
_RACE_GAIN = 0.05  # share by which the turned G must be better, first in concavity and then in the score


@dataclass
class _Run:
    """Hold the state of the training: stage, step, and the network at the start of the stage and at its best."""

    number: int
    step: int
    start: State  # the network at the start of the stage, which gave corners and cuts
    best: State
    best_key: tuple[float, float] = (math.inf, math.inf)  # folded samples, then loss


class Trainer:
    """Train G on one surface.

    vertices: (n, 3), at volume 1. faces: (m, 3). given_corners: (8,) vertex numbers, or None. The random numbers of a
    step depend on the seed, the stage and the step only.
    """

    def __init__(
        self,
        vertices: Array,
        faces: IntArray,
        config: Config,
        *,
        seed: int,
        device: str,
        dtype: str,
        given_corners: IntArray | None,
        history: History,
        progress: ProgressCallback,
        checkpoints: Checkpoints,
    ) -> None:
        self.config, self.seed = config, seed
        self.vertices, self.faces, self.corners = vertices, faces, given_corners
        self.history, self.progress, self.checkpoints = history, progress, checkpoints
        self.network = InverseMap(config.network, np.random.default_rng(seed), device, dtype)
        if config.train.whiten:
            inside = Solid(vertices, faces).lattice(config.train.cell)
            if len(inside) < _FEWEST:
                raise MeshError(_TOO_THIN)
            self.network.affine = self.network.there(start_map(inside))
        self.objective = Objective(self.network, stencils(vertices, faces, config.train.cell))

    def run(self, *, give_up: bool = False) -> InverseMap | None:
        """Train all stages, or continue from a checkpoint; return the network at the best state of the last stage.

        With `give_up`, return None where the first stage ends with a loss above `easy_loss`, see `_misfit`. If the
        mapped surface is still too far from a cube for its edges to be traced, the stages that hold edges are left out
        with a warning, because the spline stage moves the edges in any case; where the user gave the corners, PathError
        is raised instead.
        """
        given, limit = self.corners is not None, self.config.train.easy_loss
        saved = self.checkpoints.load(_CHECKPOINT)
        first = int(saved[1]["number"]) if saved else 0
        for number, stage in list(enumerate(self.config.stages))[first:]:
            run = self._load_run(*saved) if saved else self._new_run(number)
            try:
                boundary = self._prepare(stage)
            except PathError as error:
                if given:
                    raise
                _log.warning("training ends before stage %s: %s", stage.name, error)
                break
            optimizer = TrainingOptimizer(self.network, self.config.train)
            if saved:
                self._load_progress(saved[0], optimizer)
            elif number == self._race_stage:
                run, optimizer = self._race(number, boundary)
            self._train(run, boundary, optimizer)
            if number == 0 and limit is not None and self._misfit(stage) > limit:
                if give_up:
                    return None
                _log.warning("the shape is hard for the network, and trained to the end: no other start may follow")
            saved = None
        return self.network

    def map(self, points: Array) -> Array:
        """Return G (m, 3) at points (m, 3), as float64."""
        return self.network.at(points)

    def mapped(self) -> Array:
        """Return G at the surface's vertices, (n, 3), for the present network."""
        return self.map(self.vertices)

    def _prepare(self, stage: StageConfig) -> BoundaryData:
        """Choose corners and cut the surface by the present network, in the stages that need them."""
        weights = STAGES[stage.name].weights
        if weights.cor > 0.0 and self.corners is None:
            self.corners = choose_corners(self.mapped())
        vertices, faces, corners = self.vertices, self.faces, self.corners
        labels = paths = None
        if weights.edge > 0.0:
            assert corners is not None
            surface = cut_surface(CubeLayout(vertices, faces, self.mapped(), len(vertices)), corners)
            vertices, faces = surface.layout.points, surface.layout.faces
            path, target, following = edge_targets(self.map(vertices), surface.paths)
            paths = EdgePaths(path, target, following)
            labels = surface.face_labels
        sampler = TriangleSampler(vertices, faces, self.config.train.triangles)
        return BoundaryData(vertices, faces, sampler, corners, labels, paths)

    def _misfit(self, stage: StageConfig) -> float:
        """Return the loss of a stage at its best state, without the distortion.

        The other terms measure how far G is from its target. A straight rod has a large distortion on any ball, and yet
        suits the network.
        """
        rows = [row for row in self.history.rows if row[0] == stage.name]
        _, _, loss, _, terms = min(rows, key=lambda row: (row[3], row[2]))
        return loss - STAGES[stage.name].weights.arap * terms["arap"]

    @property
    def _race_stage(self) -> int | None:
        """Return the number of the first stage towards the cube, where G may be turned.

        None is returned where corners are given or the options have no race.
        """
        if self.corners is not None or self.config.train.race == 0.0:
            return None
        return next((number for number, stage in enumerate(self.config.stages) if stage.name == "cube"), None)

    def _race(self, number: int, boundary: BoundaryData) -> tuple[_Run, TrainingOptimizer]:
        """Begin a stage twice, with G as it is and with G turned by the best turn of the cube; keep the better run.

        The turn puts the cube's edges out of hollows; without such a turn the stage begins once. Returns the better run
        and its optimiser; the network then has its state. The mapped domain is a ball at this stage. The turn is
        computed beforehand, but only training shows whether it lowers the loss, because corners may be harder to reach.
        """
        train, begun = self.config.train, len(self.history.rows)
        away, start = self.mapped() - 0.5, self.network.state()
        directions = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        ball = CubeLayout(self.vertices, self.faces, directions, len(self.vertices))
        turn = best_turn(ball, np.random.default_rng(self.seed))
        as_it_is = concavity(ball)
        if concavity(replace(ball, places=ball.places @ turn.T)) > as_it_is - _RACE_GAIN * abs(as_it_is):
            return self._new_run(number), TrainingOptimizer(self.network, train)
        least, winner = math.inf, None
        for rotation, share in ((np.eye(3), 1.0), (turn, 1.0 - _RACE_GAIN)):
            self.network.restore(start)
            self.network.turn(rotation)
            run, optimizer = (
                _Run(number, 0, self.network.state(), self.network.state()),
                TrainingOptimizer(self.network, train),
            )
            for _ in self._steps(run, boundary, optimizer, math.ceil(train.race * self.config.stages[number].steps)):
                pass
            rows = self.history.rows[begun:]
            del self.history.rows[begun:]
            last = [(loss, terms["arap"]) for _, _, loss, _, terms in rows[-_COMPARED_STEPS:]]
            score = float(np.mean([distortion + _REST * (loss - distortion) for loss, distortion in last]))
            if score < share * least:
                least, winner = score, (run, optimizer, self.network.state(), rows)
        assert winner is not None
        run, optimizer, state, rows = winner
        self.network.restore(state)
        self.history.rows += rows
        return run, optimizer

    def _train(self, run: _Run, boundary: BoundaryData, optimizer: TrainingOptimizer) -> None:
        """Train one stage, and leave the network at its best state: the fewest folded samples, then the lowest loss."""
        steps = self.config.stages[run.number].steps
        try:
            for _ in self._steps(run, boundary, optimizer, steps):
                if run.step % _CHECKPOINT_STEPS == 0 or run.step == steps:
                    self._save(run, optimizer)
        except KeyboardInterrupt:
            self._save(run, optimizer)
            raise
        self.network.restore(run.best)

    def _steps(self, run: _Run, boundary: BoundaryData, optimizer: TrainingOptimizer, until: int) -> Iterator[None]:
        """Take the steps of a stage up to the step `until`, and report each step."""
        stage = self.config.stages[run.number]
        later = sum(stage.steps for stage in self.config.stages[run.number + 1 :])
        started, begun = time.perf_counter(), run.step
        while run.step < until:
            self._step(run, stage, boundary, optimizer)
            pace = (time.perf_counter() - started) / (run.step - begun)
            _, _, loss, folded, _ = self.history.rows[-1]
            left = pace * (stage.steps - run.step + later)
            self.progress(Progress(stage.name, run.step, stage.steps, loss, folded, left, self.mapped))
            yield

    def _step(self, run: _Run, stage: StageConfig, boundary: BoundaryData, optimizer: TrainingOptimizer) -> None:
        """Take one step of the optimiser; the state changes only once the loss is known to be finite."""
        generator = np.random.default_rng([self.seed, run.number, run.step])
        loss = self.objective(STAGES[stage.name], boundary, generator)
        if not math.isfinite(loss.value):
            raise FloatingPointError(f"stage {stage.name}, step {run.step}: the loss is not finite")
        if (loss.folded, loss.value) < run.best_key:
            run.best_key, run.best = (loss.folded, loss.value), self.network.state()
        optimizer.step(loss.gradient(), self._share(run.step / stage.steps))
        self.history.add(stage.name, run.step, loss.value, loss.folded, loss.terms)
        run.step += 1

    def _save(self, run: _Run, optimizer: TrainingOptimizer) -> None:
        parts = {"now": self.network.state(), "start": run.start, "best": run.best, "optimizer": optimizer.state()}
        arrays = {f"{part}.{name}": value for part, state in parts.items() for name, value in state.items()}
        state = {
            "number": run.number,
            "step": run.step,
            "best_key": run.best_key,
            "corners": None if self.corners is None else self.corners.tolist(),
            "history": self.history.rows,
        }
        self.checkpoints.save(_CHECKPOINT, arrays, state)

    def _new_run(self, number: int) -> _Run:
        return _Run(number, 0, self.network.state(), self.network.state())

    def _load_run(self, arrays: State, state: dict[str, Any]) -> _Run:
        """Restore everything but the optimiser; leave the network as it was at the start of the stage."""
        self.corners = None if state["corners"] is None else np.array(state["corners"])
        self.history.rows[:] = [tuple(row) for row in state["history"]]
        start, best = _part(arrays, "start"), _part(arrays, "best")
        self.network.restore(start)
        folded, loss = state["best_key"]
        return _Run(state["number"], state["step"], start, best, (folded, loss))

    def _load_progress(self, arrays: State, optimizer: TrainingOptimizer) -> None:
        self.network.restore(_part(arrays, "now"))
        optimizer.restore(_part(arrays, "optimizer"))

    def _share(self, done: float) -> float:
        """Return the share of the learning rates, which falls along a cosine.

        done: the share of the stage's steps that are finished, below 1.
        """
        last = self.config.train.final_share
        return last + 0.5 * (1.0 - last) * (1.0 + math.cos(math.pi * done))


def start_map(points: Array) -> Array:
    """Return the symmetric map (3, 3) of determinant 1 that gives a cloud (m, 3) equal width in all directions."""
    values, vectors = np.linalg.eigh(np.cov(points.T))
    return np.asarray((vectors * np.sqrt(values.prod() ** (1.0 / 3.0) / values)) @ vectors.T)


def _part(arrays: State, prefix: str) -> State:
    """Return the arrays whose names begin with `prefix` and a dot, under the rest of their names."""
    return {key.removeprefix(f"{prefix}."): value for key, value in arrays.items() if key.startswith(f"{prefix}.")}
