"""The network G: an affine map plus a residual MLP on a positional encoding (section 4.2)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from ..config import NetworkConfig


class ResidualModule(nn.Module):
    """x + relu(Linear(x))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.linear = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Return the module's values: (m, width) -> (m, width)."""
        return x + torch.relu(self.linear(x))


class InverseMap(nn.Module):
    """G(x) = c + A (x - c) + MLP(encoding(x)), c = (1/2, 1/2, 1/2), from the domain (volume 1, around c) to the cube.

    The last layer starts at zero, so G *is* the affine map before the first step: with A = I, the default, the identity
    that the paper trains towards. A is not trained. generator: draws the other layers' first weights.
    """

    multiples: Tensor
    affine: Tensor

    def __init__(self, config: NetworkConfig, generator: torch.Generator | None = None) -> None:
        super().__init__()
        self.register_buffer("affine", torch.eye(3))
        self.register_buffer("multiples", torch.arange(1.0, config.frequencies + 1.0))
        self.scale = nn.Parameter(torch.tensor(config.scale))  # k of the encoding
        self.first = nn.Linear(6 * config.frequencies + 3, config.width)
        self.residual = nn.Sequential(*(ResidualModule(config.width) for _ in range(config.modules)))
        self.last = nn.Linear(config.width, 3)
        for layer in (m for m in self.modules() if isinstance(m, nn.Linear)):
            nn.init.kaiming_uniform_(layer.weight, a=math.sqrt(5.0), generator=generator)
            bound = 1.0 / math.sqrt(layer.in_features)
            nn.init.uniform_(layer.bias, -bound, bound, generator=generator)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def encode(self, x: Tensor) -> Tensor:
        """Return x, sin(n k x) / (n k), cos(n k x) / (n k) for n = 1..N: (m, 3) -> (m, 6 N + 3)."""
        nk = self.multiples * self.scale  # (N,)
        phase = x[:, None, :] * nk[:, None]  # (m, N, 3)
        waves = torch.cat([torch.sin(phase), torch.cos(phase)], dim=2) / nk[:, None]
        return torch.cat([x, waves.flatten(1)], dim=1)

    def forward(self, x: Tensor) -> Tensor:
        """Return G at points: (m, 3) -> (m, 3)."""
        hidden = torch.relu(self.first(self.encode(x)))
        shift: Tensor = self.last(self.residual(hidden))
        return (x - 0.5) @ self.affine.T + 0.5 + shift
