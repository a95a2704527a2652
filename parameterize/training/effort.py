"""Computes the effort of a training step: the number of mapped points, and a pass of the network to be timed."""

from collections.abc import Callable

import torch

from ..arrays import Array, IntArray
from ..config import NetworkConfig, TrainConfig
from .network import InverseMap, map_in_pieces
from .samples import stencils


def points_of_a_step(vertices: Array, faces: IntArray, train: TrainConfig) -> int:
    """Return the number of points that the network maps in a step; vertices (n, 3) at volume 1, faces (m, 3)."""
    nodes = stencils(vertices, faces, train.cell, device=torch.device("cpu"), dtype=torch.float32).nodes
    return len(nodes) + min(len(vertices), 3 * train.triangles)


def a_pass(config: NetworkConfig, device: str, count: int) -> Callable[[], None]:
    """Return a function that runs a new network forward and backward on `count` points, on "cpu" or "cuda"."""
    with torch.random.fork_rng(devices=[]):
        network = InverseMap(config).to(device)
    points = torch.full((count, 3), 0.5, device=device)

    def run() -> None:
        loss = map_in_pieces(network, points).square().sum()
        loss.backward()  # type: ignore[no-untyped-call]
        float(loss.detach())  # waits for the device

    return run
