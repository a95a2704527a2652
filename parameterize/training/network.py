"""Defines the network G: an affine map plus a residual MLP on a positional encoding (section 4.2)."""

import math
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn

from ..config import NetworkConfig
from ..threads import in_parallel

_PIECE = 2048  # points that a thread takes at a time, at most
_SHARES = 4  # the number of pieces is a multiple of this, so that up to so many threads end together


class ResidualModule(nn.Module):
    """Compute x + relu(Linear(x))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.linear = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Return the module's values (m, width) at x (m, width)."""
        return x + torch.relu(self.linear(x))


class InverseMap(nn.Module):
    """Compute G(x) = c + A (x - c) + MLP(encoding(x)), c = (1/2, 1/2, 1/2), from the domain to the cube.

    The domain has volume 1 and lies around c. The last layer starts at zero, so G *is* the affine map before the first
    step; with the default A = I it is the identity, towards which the paper trains. A is not trained. generator: the
    random generator of the other layers' first weights.
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

    @torch.no_grad()
    def turn(self, rotation: Tensor) -> None:
        """Turn the image of G about the centre of the cube by a rotation (3, 3), in place."""
        for part in (self.affine, self.last.weight, self.last.bias):
            part.copy_(rotation.to(part) @ part)

    def encode(self, x: Tensor) -> Tensor:
        """Return x, sin(n k x) / (n k), cos(n k x) / (n k) for n = 1..N, (m, 6 N + 3), at points x (m, 3)."""
        nk = self.multiples * self.scale  # (N,)
        phase = x[:, None, :] * nk[:, None]  # (m, N, 3)
        waves = torch.cat([torch.sin(phase), torch.cos(phase)], dim=2) / nk[:, None]
        return torch.cat([x, waves.flatten(1)], dim=1)

    def forward(self, x: Tensor) -> Tensor:
        """Return G (m, 3) at points (m, 3)."""
        hidden = torch.relu(self.first(self.encode(x)))
        shift: Tensor = self.last(self.residual(hidden))
        return (x - 0.5) @ self.affine.T + 0.5 + shift


def map_in_pieces(network: nn.Module, points: Tensor) -> Tensor:
    """Return network(points) (m, 3) at points (m, 3), with its gradient; any number of threads gives the same bits."""
    mapped: Tensor = _InPieces.apply(network, points, *network.parameters())  # type: ignore[no-untyped-call]
    return mapped


class _InPieces(torch.autograd.Function):
    """Run the network forward and backward on pieces of the points, and add the pieces' gradients in their order."""

    @staticmethod
    def forward(ctx: Any, network: nn.Module, points: Tensor, *parameters: Tensor) -> Tensor:
        """Map the points and keep the graphs for the backward pass."""
        count = _SHARES * -(-len(points) // (_SHARES * _PIECE)) if points.device.type == "cpu" else 1

        def part(piece: Tensor) -> Tensor:
            with torch.enable_grad():
                mapped: Tensor = network(piece)
            return mapped

        ctx.pieces, ctx.parameters = in_parallel(part, torch.tensor_split(points, count)), parameters
        return torch.cat([piece.detach() for piece in ctx.pieces])

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Any:
        """Return the gradients with respect to the parameters.

        The gradient of a sum avoids torch's symbolic shapes, which take as long to load as many steps.
        """

        def part(pair: tuple[Tensor, Tensor]) -> tuple[Tensor, ...]:
            mapped, dual = pair
            with torch.enable_grad():
                total = (mapped * dual).sum()
            return torch.autograd.grad(total, ctx.parameters)

        pairs = list(zip(ctx.pieces, torch.split(gradient, [len(piece) for piece in ctx.pieces]), strict=True))
        parts = in_parallel(part, pairs)
        return None, None, *(sum(of_one[1:], start=of_one[0]) for of_one in zip(*parts, strict=True))


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
