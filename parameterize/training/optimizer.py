"""The optimiser of the training: Muon for the hidden layers' matrices, Adam for all else.

Muon takes steps whose singular values are all alike (Jordan et al., 2024), so that directions in which the gradient is
small advance as fast as the others. That of torch computes in bfloat16, which takes 20 times as long as float32 on
processors without instructions for it; this one computes in the parameters' own precision.
"""

import math
from typing import Any

import torch
from torch import Tensor

from ..config import TrainConfig
from .network import InverseMap

Tensors = dict[str, Tensor]


class Muon(torch.optim.Optimizer):
    """Takes steps along U V^T, where U S V^T is a matrix's gradient with Nesterov's momentum.

    lr: their singular values, about; of a matrix with more rows than columns, times the square root of the ratio.
    """

    _MOMENTUM = 0.95
    _POLYNOMIAL = (3.4445, -4.7750, 2.0315)  # of the quintic iteration by Jordan et al.: singular values go near 1
    _ITERATIONS = 5

    def __init__(self, matrices: list[Tensor], lr: float) -> None:
        super().__init__(matrices, {"lr": lr})

    @torch.no_grad()
    def step(self, closure: Any = None) -> None:  # type: ignore[override]
        """Take one step; `closure` is torch's, and not used."""
        for group in self.param_groups:
            for matrix in group["params"]:
                momentum = self.state[matrix].setdefault("momentum_buffer", torch.zeros_like(matrix))
                momentum.lerp_(matrix.grad, 1.0 - self._MOMENTUM)
                direction = self._orthogonal(matrix.grad.lerp(momentum, self._MOMENTUM))
                rows, columns = matrix.shape
                matrix.sub_(direction, alpha=group["lr"] * math.sqrt(max(1.0, rows / columns)))

    def _orthogonal(self, matrix: Tensor) -> Tensor:
        """Return U V^T of a matrix U S V^T, about.

        Singular values above a hundredth of the matrix' Frobenius norm come to lie between 0.68 and 1.21.
        """
        a, b, c = self._POLYNOMIAL
        tall = matrix.shape[0] > matrix.shape[1]
        x = matrix.T if tall else matrix
        x = x / x.norm().clamp(min=1e-7)
        for _ in range(self._ITERATIONS):
            gram = x @ x.T
            x = torch.addmm(x, torch.addmm(gram, gram, gram, beta=b, alpha=c), x, beta=a)
        return x.T if tall else x


class TrainingOptimizer:
    """Muon and Adam side by side, with one schedule."""

    def __init__(self, network: InverseMap, config: TrainConfig) -> None:
        hidden, others = list[Tensor](), list[Tensor]()
        for p in network.parameters():
            is_hidden = config.matrix_rate > 0.0 and p.ndim == 2 and p is not network.last.weight
            (hidden if is_hidden else others).append(p)
        self._parts: dict[str, torch.optim.Optimizer] = {"adam": torch.optim.Adam(others, lr=config.learning_rate)}
        if hidden:
            self._parts["muon"] = Muon(hidden, lr=config.matrix_rate)
        self._rates = {name: part.param_groups[0]["lr"] for name, part in self._parts.items()}

    def clear(self) -> None:
        """Forget the gradients of the last step."""
        for part in self._parts.values():
            part.zero_grad(set_to_none=True)

    def step(self, share: float) -> None:
        """Take one step at a share of the learning rates."""
        for name, part in self._parts.items():
            part.param_groups[0]["lr"] = share * self._rates[name]
            part.step()

    def tensors(self) -> Tensors:
        """Return the moments, to be kept in a checkpoint."""
        return {
            f"{name}.{index}.{moment}": value
            for name, part in self._parts.items()
            for index, moments in part.state_dict()["state"].items()
            for moment, value in moments.items()
        }

    def restore(self, tensors: Tensors) -> None:
        """Take moments that `tensors` has returned."""
        for name, part in self._parts.items():
            state: dict[int, Tensors] = {}
            for key, value in tensors.items():
                owner, index, moment = key.split(".")
                if owner == name:
                    state.setdefault(int(index), {})[moment] = value
            part.load_state_dict({"state": state, "param_groups": part.state_dict()["param_groups"]})
