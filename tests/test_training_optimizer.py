"""Muon for the hidden matrices, Adam for the rest, one schedule, and moments that a checkpoint brings back."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from parameterize.config import NetworkConfig, TrainConfig
from parameterize.training.network import InverseMap
from parameterize.training.optimizer import Adam, Muon, TrainingOptimizer

POINTS = np.random.default_rng(5).random((40, 3))


def made(config=None, seed=0):
    rng = np.random.default_rng(seed)
    network = InverseMap(NetworkConfig(width=16, modules=2, frequencies=3), rng, "cpu", "float64")
    network.parameters["last.weight"] = network.there(rng.normal(size=(3, 16)))
    return network, TrainingOptimizer(network, config or TrainConfig())


def stepped(network, optimizer, count, share=1.0):
    for _ in range(count):
        mapped, pulled_back = network.with_gradient(POINTS)
        gradient = pulled_back(2.0 * (mapped - 2.0 * POINTS))
        optimizer.step(gradient, share)
    return gradient


def test_steps_of_hidden_matrices_have_singular_values_that_are_alike():
    network, optimizer = made()
    before = network.state()
    gradient = np.linalg.svd(stepped(network, optimizer, 1)["module0.weight"], compute_uv=False)
    step = np.linalg.svd(network.state()["module0.weight"] - before["module0.weight"], compute_uv=False)
    assert gradient[0] > 10.0 * gradient[4]
    assert step[0] < 3.0 * step[4]


@pytest.mark.parametrize("shape", [(16, 16), (24, 9), (9, 24)])
def test_steps_are_those_of_torchs_muon_but_for_its_rounding(shape):
    """That of torch computes in bfloat16, so its steps have an error of up to a hundredth."""
    generator = torch.Generator().manual_seed(1)
    start = torch.randn(shape, generator=generator)
    ours, theirs = {"m": start.clone()}, start.clone().requires_grad_()
    muon, torchs = Muon(ours, lr=0.1), torch.optim.Muon([theirs], lr=0.1, weight_decay=0.0)
    for number in range(1, 4):
        theirs.grad = torch.randn(shape, generator=generator)
        muon.step(ours, {"m": theirs.grad}, 1.0, number)
        torchs.step()
    moved = (theirs - start).detach()
    assert float((ours["m"] - theirs).detach().norm()) < 0.02 * float(moved.norm())


def test_adams_steps_are_those_of_torch():
    generator = torch.Generator().manual_seed(1)
    start = torch.randn(50, generator=generator)
    ours, theirs = {"a": start.clone()}, start.clone().requires_grad_()
    adam, torchs = Adam(ours, lr=0.01), torch.optim.Adam([theirs], lr=0.005)
    for number in range(1, 4):
        theirs.grad = torch.randn(50, generator=generator)
        adam.step(ours, {"a": theirs.grad}, 0.5, number)
        torchs.step()
    assert torch.allclose(ours["a"], theirs.detach(), atol=1e-6)


def test_every_parameter_moves_and_a_share_of_the_rate_moves_it_by_that_share():
    moves = []
    for share in (1.0, 0.25):
        network, optimizer = made()
        before = network.state()
        stepped(network, optimizer, 1, share)
        moves.append([np.linalg.norm(now - before[name]) for name, now in network.state().items() if name != "affine"])
    assert min(moves[0]) > 0.0
    assert moves[1] == pytest.approx([0.25 * move for move in moves[0]], rel=1e-2)


def test_without_a_rate_for_matrices_adam_trains_all():
    network, optimizer = made(replace(TrainConfig(), matrix_rate=0.0))
    other, _ = made()
    adam = Adam(other.parameters, TrainConfig().learning_rate)
    for number in range(1, 4):
        adam.step(other.parameters, stepped(network, optimizer, 1), 1.0, number)
    assert all(torch.equal(network.parameters[name], values) for name, values in other.parameters.items())


def test_restored_moments_go_on_bit_for_bit():
    network, optimizer = made()
    stepped(network, optimizer, 5)
    other, fresh = made(seed=1)
    other.restore(network.state())
    fresh.restore(optimizer.state())
    stepped(network, optimizer, 3)
    stepped(other, fresh, 3)
    assert all(torch.equal(network.parameters[name], values) for name, values in other.parameters.items())
