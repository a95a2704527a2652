import pytest
import torch

from parameterize.config import NetworkConfig
from parameterize.training.network import InverseMap, ResidualModule, map_in_pieces

SMALL = NetworkConfig(width=16, modules=2, frequencies=3)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_untrained_network_is_the_identity(dtype):
    torch.manual_seed(0)
    network = InverseMap(SMALL).to(dtype)
    points = torch.rand(50, 3, dtype=dtype) * 3.0 - 1.0
    assert torch.allclose(network(points), points, atol=4.0 * torch.finfo(dtype).eps)


def test_untrained_network_is_the_affine_map_it_starts_from():
    network = InverseMap(SMALL)
    matrix = torch.tensor([[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.5, 0.0, 1.0]])
    network.affine.copy_(matrix)
    points = torch.rand(50, 3)
    assert torch.allclose(network(points), (points - 0.5) @ matrix.T + 0.5, atol=1e-6)


def test_identity_network_still_has_a_gradient_to_leave_it():
    torch.manual_seed(0)
    network = InverseMap(SMALL)
    points = torch.rand(50, 3)
    (network(points) - 2.0 * points).square().sum().backward()
    assert float(network.last.weight.grad.abs().max()) > 0.0


def test_encoding_by_hand():
    network = InverseMap(NetworkConfig(width=4, modules=1, frequencies=2)).double()
    with torch.no_grad():
        network.scale.fill_(1.5)
    x = torch.tensor([[0.1, 0.2, 0.7]], dtype=torch.float64)
    encoded = network.encode(x)
    expected = [x]
    for n in (1, 2):
        phase = 1.5 * n * x
        expected += [torch.sin(phase) / (1.5 * n), torch.cos(phase) / (1.5 * n)]
    assert encoded.shape == (1, 6 * 2 + 3)
    assert torch.equal(encoded.sort().values, torch.cat(expected, dim=1).sort().values)
    assert torch.allclose(encoded, torch.cat(expected, dim=1), atol=1e-15)


def test_residual_module_adds_to_its_input():
    module = ResidualModule(5)
    x = torch.randn(4, 5)
    assert torch.equal(module(x), x + torch.relu(x @ module.linear.weight.T + module.linear.bias))


def test_shape_follows_the_options():
    network = InverseMap(SMALL)
    assert network.first.in_features == 6 * 3 + 3 and network.first.out_features == 16
    assert len(network.residual) == 2
    assert "multiples" in network.state_dict() and "scale" in dict(network.named_parameters())


def test_first_weights_are_drawn_from_the_generator():
    torch.manual_seed(5)
    expected = torch.nn.Linear(6 * 3 + 3, 16)
    torch.manual_seed(6)
    network = InverseMap(SMALL, torch.Generator().manual_seed(5))
    assert torch.equal(network.first.weight, expected.weight) and torch.equal(network.first.bias, expected.bias)


def test_pieces_give_the_networks_map_and_gradient_with_the_same_bits_for_any_number_of_threads(monkeypatch):
    network = InverseMap(SMALL).double()
    torch.nn.init.normal_(network.last.weight, generator=torch.Generator().manual_seed(0))
    points = torch.rand(2500, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(1))

    def found(mapping):
        network.zero_grad()
        mapped = mapping(points)
        mapped.square().sum().backward()
        return [mapped.detach(), *(parameter.grad for parameter in network.parameters())]

    expected = found(network)
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    one = found(lambda x: map_in_pieces(network, x))
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    three = found(lambda x: map_in_pieces(network, x))
    assert all(torch.allclose(a, b, rtol=1e-10) for a, b in zip(expected, one, strict=True))
    assert all(torch.equal(a, b) for a, b in zip(one, three, strict=True))
