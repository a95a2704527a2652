"""The optimiser of the training: Muon for the hidden layers' matrices, Adam for all else.

Muon takes steps whose singular values are all alike (Jordan et al., 2024), so that directions in which the gradient is
small advance as fast as the others.
"""

import torch
from torch import Tensor

from ..config import TrainConfig
from .network import InverseMap

Tensors = dict[str, Tensor]


class TrainingOptimizer:
    """Muon and Adam side by side, with one schedule."""

    def __init__(self, network: InverseMap, config: TrainConfig) -> None:
        hidden, others = list[Tensor](), list[Tensor]()
        for p in network.parameters():
            is_hidden = config.matrix_rate > 0.0 and p.ndim == 2 and p is not network.last.weight
            (hidden if is_hidden else others).append(p)
        self._parts: dict[str, torch.optim.Optimizer] = {"adam": torch.optim.Adam(others, lr=config.learning_rate)}
        if hidden:
            self._parts["muon"] = torch.optim.Muon(hidden, lr=config.matrix_rate, weight_decay=0.0)
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
