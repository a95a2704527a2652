"""Muon for the hidden matrices, Adam for the rest, one schedule, and moments that a checkpoint brings back."""

import subprocess
import sys
from copy import deepcopy
from dataclasses import replace

import pytest
import torch

from parameterize.config import NetworkConfig, TrainConfig
from parameterize.training.network import InverseMap
from parameterize.training.optimizer import Muon, TrainingOptimizer

SMALL = NetworkConfig(width=16, modules=2, frequencies=3)


def made(config=None, seed=0):
    network = InverseMap(SMALL, torch.Generator().manual_seed(seed))
    torch.nn.init.normal_(network.last.weight, generator=torch.Generator().manual_seed(seed))
    return network, TrainingOptimizer(network, config or TrainConfig())


def stepped(network, optimizer, count, share=1.0):
    points = torch.rand(40, 3, generator=torch.Generator().manual_seed(5))
    for _ in range(count):
        optimizer.clear()
        (network(points) - 2.0 * points).square().sum().backward()
        optimizer.step(share)


def test_steps_of_hidden_matrices_have_singular_values_that_are_alike():
    network, optimizer = made()
    before = network.residual[0].linear.weight.detach().clone()
    stepped(network, optimizer, 1)
    gradient = torch.linalg.svdvals(network.residual[0].linear.weight.grad)
    step = torch.linalg.svdvals(network.residual[0].linear.weight.detach() - before)
    assert gradient[0] > 10.0 * gradient[4]
    assert step[0] < 3.0 * step[4]


@pytest.mark.parametrize("shape", [(16, 16), (24, 9), (9, 24)])
def test_steps_are_those_of_torchs_muon_but_for_its_rounding(shape):
    """That of torch computes in bfloat16, so its steps have an error of up to a hundredth."""
    generator = torch.Generator().manual_seed(1)
    start = torch.randn(shape, generator=generator)
    ours, theirs = start.clone().requires_grad_(), start.clone().requires_grad_()
    muon, torchs = Muon([ours], lr=0.1), torch.optim.Muon([theirs], lr=0.1, weight_decay=0.0)
    for _ in range(3):
        ours.grad = torch.randn(shape, generator=generator)
        theirs.grad = ours.grad.clone()
        muon.step(1.0)
        torchs.step()
    moved = (theirs - start).detach()
    assert float((ours - theirs).detach().norm()) < 0.02 * float(moved.norm())


def test_every_parameter_moves_and_a_share_of_the_rate_moves_it_by_that_share():
    moves = []
    for share in (1.0, 0.25):
        network, optimizer = made()
        before = deepcopy(network)
        stepped(network, optimizer, 1, share)
        pairs = zip(network.parameters(), before.parameters(), strict=True)
        moves.append([float((now - then).detach().norm()) for now, then in pairs])
    assert min(moves[0]) > 0.0
    assert moves[1] == pytest.approx([0.25 * move for move in moves[0]], rel=1e-2)


def test_without_a_rate_for_matrices_adam_trains_all():
    network, optimizer = made(replace(TrainConfig(), matrix_rate=0.0))
    other, _ = made()
    adam = torch.optim.Adam(other.parameters(), lr=TrainConfig().learning_rate)
    points = torch.rand(40, 3, generator=torch.Generator().manual_seed(5))
    stepped(network, optimizer, 3)
    for _ in range(3):
        adam.zero_grad()
        (other(points) - 2.0 * points).square().sum().backward()
        adam.step()
    assert all(torch.equal(a, b) for a, b in zip(network.parameters(), other.parameters(), strict=True))


def test_restored_moments_go_on_bit_for_bit():
    network, optimizer = made()
    stepped(network, optimizer, 5)
    other, fresh = made(seed=1)
    other.load_state_dict(network.state_dict())
    fresh.restore({name: value.clone() for name, value in optimizer.tensors().items()})
    stepped(network, optimizer, 3)
    stepped(other, fresh, 3)
    assert all(torch.equal(a, b) for a, b in zip(network.parameters(), other.parameters(), strict=True))


def test_training_steps_do_not_load_torchs_compiler():
    """To load it takes as long as 50 steps; `torch.optim.Adam` and given gradients of autograd do."""
    code = """
import sys, torch
from parameterize.config import NetworkConfig, TrainConfig
from parameterize.training.network import InverseMap, map_in_pieces
from parameterize.training.optimizer import TrainingOptimizer
network = InverseMap(NetworkConfig(width=8, modules=1, frequencies=2))
optimizer = TrainingOptimizer(network, TrainConfig())
map_in_pieces(network, torch.rand(9, 3)).square().sum().backward()
optimizer.step(1.0)
print([name for name in ("torch._dynamo", "sympy") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
