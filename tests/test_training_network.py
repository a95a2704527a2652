import numpy as np
import pytest
import torch

from parameterize.config import NetworkConfig
from parameterize.training.network import InverseMap

SMALL = NetworkConfig(width=16, modules=2, frequencies=3)


def made(config=SMALL, dtype="float64", seed=0):
    return InverseMap(config, np.random.default_rng(seed), "cpu", dtype)


def trained():
    """A network whose last layer is not zero, and its points."""
    network, rng = made(), np.random.default_rng(1)
    network.parameters["last.weight"] = network.there(rng.normal(size=(3, 16)))
    return network, rng.random((2500, 3))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_untrained_network_is_the_identity(dtype):
    points = 3.0 * np.random.default_rng(0).random((50, 3)) - 1.0
    mapped = made(dtype=dtype).at(points)
    assert mapped.dtype == np.float64
    assert mapped == pytest.approx(points, abs=6.0 * float(np.finfo(dtype).eps))


def test_untrained_network_is_the_affine_map_it_starts_from():
    network = made()
    matrix = np.array([[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.5, 0.0, 1.0]])
    network.affine = network.there(matrix)
    points = np.random.default_rng(0).random((50, 3))
    assert network.at(points) == pytest.approx((points - 0.5) @ matrix.T + 0.5)


def test_identity_network_still_has_a_gradient_to_leave_it():
    mapped, pulled_back = made().with_gradient(np.random.default_rng(0).random((50, 3)))
    assert pulled_back(-mapped)["last.weight"].abs().max() > 0.0


def test_encoding_by_hand():
    network = made(NetworkConfig(width=4, modules=1, frequencies=2, scale=1.5))
    x = np.array([[0.1, 0.2, 0.7]])
    expected = [x]
    for n in (1, 2):
        expected += [np.sin(1.5 * n * x) / (1.5 * n), np.cos(1.5 * n * x) / (1.5 * n)]
    assert network.encode(torch.tensor(x)).numpy() == pytest.approx(np.concatenate(expected, axis=1), abs=1e-15)


def test_modules_add_to_their_input():
    network, points = trained()
    weights = network.state()
    hidden = np.maximum(
        network.encode(torch.tensor(points)).numpy() @ weights["first.weight"].T + weights["first.bias"], 0.0
    )
    for module in ("module0", "module1"):
        hidden = hidden + np.maximum(hidden @ weights[f"{module}.weight"].T + weights[f"{module}.bias"], 0.0)
    assert network.at(points) == pytest.approx(points + hidden @ weights["last.weight"].T)


def test_shapes_follow_the_options():
    shapes = {name: values.shape for name, values in made().parameters.items()}
    assert shapes["first.weight"] == (16, 6 * 3 + 3) and shapes["module1.weight"] == (16, 16)
    assert "module2.weight" not in shapes and shapes["scale"] == (1,)


def test_first_weights_are_drawn_from_the_generator():
    same, other = made().state(), made(seed=1).state()
    for name, values in made().state().items():
        assert np.array_equal(values, same[name])
        assert not name.startswith(("first", "module")) or not np.array_equal(values, other[name])


def test_a_restored_network_is_the_one_of_the_state():
    network, points = trained()
    other = made(seed=5)
    other.restore(network.state())
    assert np.array_equal(network.at(points), other.at(points))


def test_pieces_give_the_networks_gradient_with_the_same_bits_for_any_number_of_threads(monkeypatch):
    network, points = trained()
    slopes = np.random.default_rng(2).normal(size=points.shape)
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    found = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        mapped, pulled_back = network.with_gradient(points)
        found.append([mapped, *pulled_back(slopes).values()])
    assert all(np.array_equal(a, b) for a, b in zip(*found, strict=True))


def test_the_gradient_is_that_of_torch():
    network, points = trained()
    slopes = np.random.default_rng(2).normal(size=points.shape)
    gradient = network.with_gradient(points)[1](slopes)
    for values in network.parameters.values():
        values.requires_grad_()
    x, p = torch.tensor(points), network.parameters
    hidden = (network.encode(x) @ p["first.weight"].T + p["first.bias"]).relu()
    for module in network.modules:
        hidden = hidden + (hidden @ p[f"{module}.weight"].T + p[f"{module}.bias"]).relu()
    ((hidden @ p["last.weight"].T + p["last.bias"]) * torch.tensor(slopes)).sum().backward()
    for name, values in p.items():
        assert gradient[name].numpy() == pytest.approx(values.grad.numpy(), rel=1e-9, abs=1e-9), name
