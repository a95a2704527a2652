"""Optimises the network: Muon for the matrices of the hidden layers, Adam for all other numbers.

Muon takes steps whose singular values are all alike (Jordan et al., 2024), so that directions with a small gradient
advance as fast as the others. torch's own Muon computes in bfloat16, which takes 20 times as long as float32 on
processors without instructions for it; this class computes in the precision of the parameters.
"""

import math

import torch
from torch import Tensor
from torch.optim.adam import adam

from ..config import TrainConfig
from ..threads import in_parallel
from .network import InverseMap

Tensors = dict[str, Tensor]


def _gradient(parameter: Tensor) -> Tensor:
    assert parameter.grad is not None
    return parameter.grad


class Muon:
    """Take steps along U V^T, where U S V^T is a matrix's gradient with Nesterov's momentum.

    lr: the approximate singular values of a step; for a matrix with more rows than columns the step is larger by the
    square root of the ratio.
    """

    _MOMENTUM = 0.95
    _POLYNOMIAL = (3.4445, -4.7750, 2.0315)  # of the quintic iteration by Jordan et al.: singular values go near 1
    _ITERATIONS = 5

    def __init__(self, matrices: list[Tensor], lr: float) -> None:
        self.parameters, self._rate = matrices, lr
        self.moments = [{"momentum_buffer": torch.zeros_like(matrix)} for matrix in matrices]

    @torch.no_grad()
    def step(self, share: float) -> None:
        """Take one step at a share of the learning rate."""
        pairs = list(zip(self.parameters, self.moments, strict=True))
        in_parallel(lambda pair: self._step(*pair, share * self._rate), pairs)

    @torch.no_grad()
    def _step(self, matrix: Tensor, moments: Tensors, rate: float) -> None:
        gradient, momentum = _gradient(matrix), moments["momentum_buffer"]
        momentum.lerp_(gradient, 1.0 - self._MOMENTUM)
        direction = self._orthogonal(gradient.lerp(momentum, self._MOMENTUM))
        rows, columns = matrix.shape
        matrix.sub_(direction, alpha=rate * math.sqrt(max(1.0, rows / columns)))

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
    """Take Adam's steps as torch computes them; `torch.optim.Adam` would load torch's compiler, which takes seconds."""

    def __init__(self, parameters: list[Tensor], lr: float) -> None:
        self.parameters, self._rate = parameters, lr
        self.moments = [
            {"step": torch.zeros(()), "exp_avg": torch.zeros_like(p), "exp_avg_sq": torch.zeros_like(p)}
            for p in parameters
        ]

    @torch.no_grad()
    def step(self, share: float) -> None:
        """Take one step at a share of the learning rate."""
        steps, means, squares = ([row[name] for row in self.moments] for name in ("step", "exp_avg", "exp_avg_sq"))
        adam(
            self.parameters,
            [_gradient(p) for p in self.parameters],
            means,
            squares,
            [],
            steps,
            amsgrad=False,
            beta1=0.9,
            beta2=0.999,
            lr=share * self._rate,
            weight_decay=0.0,
            eps=1e-8,
            maximize=False,
        )


class TrainingOptimizer:
    """Run Muon and Adam side by side, with one schedule."""

    def __init__(self, network: InverseMap, config: TrainConfig) -> None:
        hidden, others = list[Tensor](), list[Tensor]()
        for p in network.parameters():
            is_hidden = config.matrix_rate > 0.0 and p.ndim == 2 and p is not network.last.weight
            (hidden if is_hidden else others).append(p)
        self._parts: dict[str, Adam | Muon] = {"adam": Adam(others, config.learning_rate)}
        if hidden:
            self._parts["muon"] = Muon(hidden, config.matrix_rate)

    def clear(self) -> None:
        """Forget the gradients of the last step."""
        for part in self._parts.values():
            for parameter in part.parameters:
                parameter.grad = None

    def step(self, share: float) -> None:
        """Take one step at a share of the learning rates."""
        for part in self._parts.values():
            part.step(share)

    def tensors(self) -> Tensors:
        """Return the moments of both optimisers, for a checkpoint."""
        return {
            f"{name}.{index}.{moment}": value
            for name, part in self._parts.items()
            for index, moments in enumerate(part.moments)
            for moment, value in moments.items()
        }

    def restore(self, tensors: Tensors) -> None:
        """Set the moments that `tensors` has returned."""
        for key, value in self.tensors().items():
            value.copy_(tensors[key])
