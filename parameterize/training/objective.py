"""The training loss of a step: the terms of `losses` on interior stencils, surface triangles, corners and paths."""

from dataclasses import dataclass

import torch
from torch import Tensor

from ..config import StageConfig, TrainConfig
from ..cube.cube import CORNERS
from . import losses
from .network import InverseMap, map_in_pieces
from .samples import Stencils, TriangleSampler, gather
from .target_shapes import nearest, nearest_on_cube_face


@dataclass(frozen=True, eq=False)
class EdgePaths:
    """The paths that go to the cube's edges: vertices (k,), targets (k, 3), pairs of neighbours (s, 2)."""

    vertices: Tensor
    targets: Tensor
    following: Tensor


@dataclass(frozen=True, eq=False)
class BoundarySamples:
    """What a stage knows of the surface: vertices (n, 3) at volume 1, triangles (m, 3), and what draws these.

    From the later stages on also: corners (8,), vertices that go to the cube's corners; labels (m,), the cube face of
    each triangle; and the paths to the cube's edges.
    """

    vertices: Tensor
    faces: Tensor
    sampler: TriangleSampler
    corners: Tensor | None = None
    labels: Tensor | None = None
    paths: EdgePaths | None = None


@dataclass(frozen=True, eq=False)
class Objective:
    """What the stages share when they compute the loss: the network, the stencils inside the domain, the options."""

    network: InverseMap
    stencils: Stencils
    config: TrainConfig

    def __call__(
        self, stage: StageConfig, boundary: BoundarySamples, generator: torch.Generator
    ) -> tuple[Tensor, int, dict[str, float]]:
        """Return the weighted sum of the terms (eq. (2) and (3)), the folded stencils, and the unweighted terms."""
        picks = boundary.sampler.draw(generator)
        used, place = torch.unique(boundary.faces[picks].flatten(), return_inverse=True)
        held = [] if boundary.corners is None else [boundary.corners]
        held += [] if boundary.paths is None else [boundary.paths.vertices]
        points = [self.stencils.shifted(generator), *(boundary.vertices[index] for index in (used, *held))]
        mapped = map_in_pieces(self.network, torch.cat(points))
        nodes, surface, *held = torch.split(mapped, [len(p) for p in points])
        surface = gather(surface, place)
        goal = self._goal(stage, boundary, surface, picks)
        terms, folded = losses.inner_terms(gather(nodes, self.stencils.index), self.stencils.cell, self.config)
        terms |= losses.surface_terms(surface, goal, self.config.wrong_side if stage.target == "cube" else 0.0)
        terms |= self._held_terms(boundary, held)
        weights = {name: getattr(stage.weights, name) for name in terms}
        if "cor" in terms:
            weights["cor"] = stage.weights.cor or stage.given_corner_weight
        total = torch.stack([weights[name] * term for name, term in terms.items()]).sum()
        return total, folded, {name: float(term.detach()) for name, term in terms.items()}

    def _goal(self, stage: StageConfig, boundary: BoundarySamples, surface: Tensor, picks: Tensor) -> Tensor:
        """Return what the corners (3 t, 3) of the mapped triangles `picks` (t,) are to reach.

        Once the surface is cut, each triangle goes to its own face of the cube.
        """
        with torch.no_grad():
            if boundary.labels is None:
                return nearest(stage.target, surface)
            return nearest_on_cube_face(surface, boundary.labels[picks].repeat_interleave(3))

    def _held_terms(self, boundary: BoundarySamples, held: list[Tensor]) -> dict[str, Tensor]:
        """Return the terms of L_bound for what is held: the mapped corners (8, 3), then the path points (k, 3)."""
        terms = {}
        if boundary.corners is not None:
            terms["cor"] = losses.distance(held[0], torch.as_tensor(CORNERS).to(held[0]))
        if boundary.paths is not None:
            paths, weight = boundary.paths, self.config.edge_direction
            terms["edge"] = losses.edge_path(held[1], paths.targets, paths.following, weight)
        return terms
