"""Defines the network G and its gradient: an affine map plus a residual MLP on a positional encoding (section 4.2)."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..arrays import Array, Floats
from ..config import NetworkConfig
from ..threads import in_parallel

Parameters = dict[str, Tensor]
Pullback = Callable[[Array], Parameters]

_PIECE = 2048  # points that a thread takes at a time, at most
_SHARES = 4  # the number of pieces is a multiple of this, so that up to so many threads end together
_MAPPED = 4 * _PIECE  # points of `at` at a time: their layers are kept


@dataclass(frozen=True, eq=False)
class _Layers:
    """Hold what a pass has computed for points x (m, 3): the encoding, the sum before each module, what each adds."""

    x: Tensor
    encoded: Tensor
    sums: list[Tensor]
    added: list[Tensor]


class InverseMap:
    """Compute G(x) = c + A (x - c) + MLP(encoding(x)), c = (1/2, 1/2, 1/2), from the domain to the cube.

    The domain has volume 1 and lies around c. The last layer starts at zero, so G *is* the affine map before the first
    step; with the default A = I it is the identity, towards which the paper trains. A is not trained. A module adds
    relu(linear(h)) to its input h. generator: the random generator of the other layers' first weights.

    device: "cpu" or "cuda". dtype: "float32" or "float64".

    parameters: the trained numbers by name, changed in place by the optimiser.
    """

    def __init__(
        self, config: NetworkConfig, generator: np.random.Generator, device: str = "cpu", dtype: str = "float32"
    ) -> None:
        self.device, self.dtype = device, getattr(torch, dtype)
        self.modules = [f"module{number}" for number in range(config.modules)]
        self.affine = self.there(np.eye(3))
        self._multiples = self.there(np.arange(1.0, config.frequencies + 1.0)[:, None])
        self.parameters: Parameters = {"scale": self.there(np.array([config.scale]))}  # k of the encoding
        width, encoded = config.width, 6 * config.frequencies + 3
        for name, inputs in [("first", encoded), *((module, width) for module in self.modules)]:
            bound = 1.0 / math.sqrt(inputs)
            self.parameters[f"{name}.weight"] = self.there(generator.uniform(-bound, bound, (width, inputs)))
            self.parameters[f"{name}.bias"] = self.there(generator.uniform(-bound, bound, width))
        self.parameters |= {"last.weight": self.there(np.zeros((3, width))), "last.bias": self.there(np.zeros(3))}

    def there(self, values: Floats) -> Tensor:
        """Return a copy of an array in the network's place and precision."""
        return torch.tensor(values, dtype=self.dtype, device=self.device)

    def state(self) -> dict[str, Floats]:
        """Return copies of all numbers, A among them, as arrays."""
        return {name: back(value) for name, value in (self.parameters | {"affine": self.affine}).items()}

    def restore(self, state: dict[str, Floats]) -> None:
        """Set the numbers that `state` has returned."""
        for name in self.parameters:
            self.parameters[name] = self.there(state[name])
        self.affine = self.there(state["affine"])

    def turn(self, rotation: Array) -> None:
        """Turn the image of G about the centre of the cube by a rotation (3, 3)."""
        turn = self.there(rotation)
        self.affine = turn @ self.affine
        for name in ("last.weight", "last.bias"):
            self.parameters[name] = turn @ self.parameters[name]

    def at(self, points: Array) -> Array:
        """Return G (m, 3) at points (m, 3), as float64."""
        blocks = np.array_split(points, -(-len(points) // _MAPPED) or 1)
        return np.concatenate([self.with_gradient(block)[0] for block in blocks])

    def with_gradient(self, points: Array) -> tuple[Array, Pullback]:
        """Return G (m, 3) at points (m, 3), and what takes the slopes (m, 3) of a loss in G to those in the parameters.

        Any number of threads gives the same bits.
        """
        count = _SHARES * -(-len(points) // (_SHARES * _PIECE)) if self.device == "cpu" else 1
        pieces = in_parallel(lambda part: self._layers(self.there(part)), np.array_split(points, count))
        mapped = in_parallel(lambda layers: back(self._image(layers)), pieces)

        def pulled_back(slopes: Array) -> Parameters:
            pairs = list(zip(pieces, np.array_split(slopes, count), strict=True))
            parts = in_parallel(lambda pair: self._gradient(pair[0], self.there(pair[1])), pairs)
            return {name: sum((part[name] for part in parts[1:]), start=parts[0][name]) for name in parts[0]}

        return np.concatenate(mapped).astype(np.float64), pulled_back

    def encode(self, x: Tensor) -> Tensor:
        """Return x, sin(n k x) / (n k), cos(n k x) / (n k) for n = 1..N, (m, 6 N + 3), at points x (m, 3)."""
        nk = self._multiples * self.parameters["scale"]  # (N, 1)
        phase = x[:, None, :] * nk
        waves = torch.cat([torch.sin(phase), torch.cos(phase)], dim=2) / nk  # (m, N, 6)
        return torch.cat([x, waves.flatten(1)], dim=1)

    def _layers(self, x: Tensor) -> _Layers:
        encoded = self.encode(x)
        sums, added = [self._rectified("first", encoded)], []
        for module in self.modules:
            added.append(self._rectified(module, sums[-1]))
            sums.append(sums[-1] + added[-1])
        return _Layers(x, encoded, sums, added)

    def _rectified(self, layer: str, inputs: Tensor) -> Tensor:
        """Return relu(linear(inputs)), (m, width)."""
        return torch.addmm(self.parameters[f"{layer}.bias"], inputs, self.parameters[f"{layer}.weight"].T).relu_()

    def _image(self, layers: _Layers) -> Tensor:
        shift = torch.addmm(self.parameters["last.bias"], layers.sums[-1], self.parameters["last.weight"].T)
        return (layers.x - 0.5) @ self.affine.T + 0.5 + shift

    def _gradient(self, layers: _Layers, slopes: Tensor) -> Parameters:
        """Return the slopes of a loss in the parameters, from those in G (m, 3), layer by layer from the last one."""
        found = _of_layer("last", slopes, layers.sums[-1])
        slopes = slopes @ self.parameters["last.weight"]
        for module, before, added in reversed(list(zip(self.modules, layers.sums, layers.added, strict=False))):
            inner = slopes * added.sign()
            found |= _of_layer(module, inner, before)
            slopes.addmm_(inner, self.parameters[f"{module}.weight"])
        slopes *= layers.sums[0].sign()
        found |= _of_layer("first", slopes, layers.encoded)
        return found | {"scale": self._of_scale(layers, slopes @ self.parameters["first.weight"])}

    def _of_scale(self, layers: _Layers, slopes: Tensor) -> Tensor:
        """Return the slope in k (1,), from those in the encoding (m, 6 N + 3).

        The derivatives of sin(n k x) / (n k) and cos(n k x) / (n k) are ((x cos(n k x), -x sin(n k x)) - these) / k.
        """
        k, shape = self.parameters["scale"], (len(slopes), len(self._multiples), 6)
        waves, of_waves = layers.encoded[:, 3:].reshape(shape), slopes[:, 3:].reshape(shape)
        arms = layers.x[:, None, :] * (self._multiples * k)
        turned = of_waves[..., :3] * waves[..., 3:] - of_waves[..., 3:] * waves[..., :3]
        return ((arms * turned).sum() - (of_waves * waves).sum()) / k


def _of_layer(layer: str, slopes: Tensor, inputs: Tensor) -> Parameters:
    """Return the slopes in a layer's weight and bias, from those in its outputs (m, k) and its inputs (m, l)."""
    return {f"{layer}.weight": slopes.T @ inputs, f"{layer}.bias": slopes.sum(dim=0)}


def back(values: Tensor) -> Floats:
    """Return a copy of the network's numbers as an array, in their precision."""
    return values.detach().cpu().numpy().copy()


def a_pass(config: NetworkConfig, device: str, count: int) -> Callable[[], None]:
    """Return a function that runs a new network forward and backward on `count` points, on "cpu" or "cuda"."""
    network = InverseMap(config, np.random.default_rng(0), device)
    points = np.full((count, 3), 0.5)

    def run() -> None:
        mapped, pulled_back = network.with_gradient(points)
        back(pulled_back(mapped)["scale"])  # waits for the device

    return run
