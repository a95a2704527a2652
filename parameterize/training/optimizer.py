"""Optimises the network: Muon for the matrices of the hidden layers, Adam for all other numbers.

Muon takes steps whose singular values are all alike (Jordan et al., 2024), so that directions with a small gradient
advance as fast as the others.
"""

import math
from collections.abc import Iterable

import numpy as np
import torch
from torch import Tensor

from ..arrays import Floats
from ..config import TrainConfig
from ..threads import in_parallel
from .network import InverseMap, Parameters, back


class Muon:
    """Take steps along U V^T, where U S V^T is a matrix's gradient with Nesterov's momentum.

    lr: the approximate singular values of a step; for a matrix with more rows than columns the step is larger by the
    square root of the ratio.
    """

    _MOMENTUM = 0.95
    _POLYNOMIAL = (3.4445, -4.7750, 2.0315)  # of the quintic iteration by Jordan et al.: singular values go near 1
    _ITERATIONS = 5

    def __init__(self, matrices: Parameters, lr: float) -> None:
        self.moments = {"mean": {name: torch.zeros_like(matrix) for name, matrix in matrices.items()}}
        self._rate = lr

    def step(self, parameters: Parameters, gradients: Parameters, share: float, _: int) -> None:
        """Take one step at a share of the learning rate, in place."""

        def one(name: str) -> None:
            gradient, mean, matrix = gradients[name], self.moments["mean"][name], parameters[name]
            mean.lerp_(gradient, 1.0 - self._MOMENTUM)
            direction = self._orthogonal(gradient.lerp(mean, self._MOMENTUM))
            rows, columns = matrix.shape
            matrix.sub_(direction, alpha=share * self._rate * math.sqrt(max(1.0, rows / columns)))

        in_parallel(one, list(self.moments["mean"]))

    def _orthogonal(self, matrix: Tensor) -> Tensor:
        """Return an approximation of U V^T for a matrix U S V^T.

        Singular values above a hundredth of the matrix's Frobenius norm come to lie between 0.68 and 1.21.
        """
        a, b, c = self._POLYNOMIAL
        tall = matrix.shape[0] > matrix.shape[1]
        x = matrix.T if tall else matrix
        x = x / x.norm().clamp(min=1e-7)
        for _ in range(self._ITERATIONS):
            gram = x @ x.T
            x = torch.addmm(x, torch.addmm(gram, gram, gram, beta=b, alpha=c), x, beta=a)
        return x.T if tall else x


class Adam:
    """Take Adam's steps (Kingma, Ba, 2015)."""

    _MEAN, _SQUARE = 0.9, 0.999  # what is kept of both moments in a step
    _LEAST = 1e-8

    def __init__(self, parameters: Parameters, lr: float) -> None:
        self.moments = {
            kind: {name: torch.zeros_like(value) for name, value in parameters.items()} for kind in ("mean", "square")
        }
        self._rate = lr

    def step(self, parameters: Parameters, gradients: Parameters, share: float, number: int) -> None:
        """Take one step at a share of the learning rate, in place; it is the `number`-th one."""
        rate = share * self._rate / (1.0 - self._MEAN**number)
        spread = math.sqrt(1.0 - self._SQUARE**number)
        for name, mean in self.moments["mean"].items():
            gradient, square, values = gradients[name], self.moments["square"][name], parameters[name]
            mean.lerp_(gradient, 1.0 - self._MEAN)
            square.mul_(self._SQUARE).addcmul_(gradient, gradient, value=1.0 - self._SQUARE)
            values.addcdiv_(mean, square.sqrt().div_(spread).add_(self._LEAST), value=-rate)


class TrainingOptimizer:
    """Run Muon and Adam side by side, with one schedule."""

    def __init__(self, network: InverseMap, config: TrainConfig) -> None:
        self._network, self._steps = network, 0
        hidden = {
            name: value
            for name, value in network.parameters.items()
            if config.matrix_rate > 0.0 and len(value.shape) == 2 and name != "last.weight"
        }
        others = {name: value for name, value in network.parameters.items() if name not in hidden}
        self._parts: dict[str, Adam | Muon] = {
            "adam": Adam(others, config.learning_rate),
            "muon": Muon(hidden, config.matrix_rate),
        }

    def step(self, gradients: Parameters, share: float) -> None:
        """Take one step at a share of the learning rates."""
        self._steps += 1
        for part in self._parts.values():
            part.step(self._network.parameters, gradients, share, self._steps)

    def state(self) -> dict[str, Floats]:
        """Return copies of the moments of both optimisers, and the number of steps, for a checkpoint."""
        return {key: back(moments[name]) for key, moments, name in self._moments()} | {"steps": np.array([self._steps])}

    def restore(self, state: dict[str, Floats]) -> None:
        """Set what `state` has returned."""
        self._steps = int(state["steps"][0])
        for key, moments, name in self._moments():
            moments[name] = self._network.there(state[key])

    def _moments(self) -> Iterable[tuple[str, Parameters, str]]:
        """Yield a key for each moment, and the table and the name that it is kept under."""
        for label, part in self._parts.items():
            for kind, moments in part.moments.items():
                for name in moments:
                    yield f"{label}.{kind}.{name}", moments, name
