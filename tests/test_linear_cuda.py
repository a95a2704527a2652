import numpy as np
import pytest

torch = pytest.importorskip("torch")

from volumes import scalar_system  # noqa: E402

from parameterize.conjugate_gradients import conjugate_gradients  # noqa: E402
from parameterize.spline.volume import FACE_NAMES  # noqa: E402
from solve import Poisson, benchmark_volume, solve_problem  # noqa: E402
from solve.discretization.space import trial_space  # noqa: E402
from solve.linear.cuda import DeviceOperator, device_preconditioner, solve_on_device  # noqa: E402
from solve.linear.preconditioner import fast_diagonalization  # noqa: E402

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))]


def build(degree, dirichlet=FACE_NAMES, reaction=None):
    volume = benchmark_volume(4, degree)
    space = trial_space(volume, refine=1)
    operator = scalar_system(volume, space, reaction=reaction, dirichlet=dirichlet)[0]
    return operator, fast_diagonalization(operator)


def close(tensor, array):
    return np.allclose(tensor.cpu().numpy(), array, rtol=0.0, atol=1e-12 * np.abs(array).max())


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    ("degree", "dirichlet", "reaction"),
    [(1, FACE_NAMES, None), (2, ("u0", "w1"), lambda x, y, z: 1.0 + x * x), (3, (), None)],
)
@pytest.mark.parametrize("layer_bytes", [1, 2**28], ids=["layer by layer", "at once"])
def test_same_numbers_as_the_compiled_kernels(device, degree, dirichlet, reaction, layer_bytes, monkeypatch):
    monkeypatch.setattr("solve.linear.cuda.LAYER_BYTES", layer_bytes)
    operator, preconditioner = build(degree, dirichlet, reaction)
    x = np.random.default_rng(0).standard_normal(tuple(s.stop - s.start for s in operator.space.window))
    there = torch.as_tensor(x, device=device)
    assert close(DeviceOperator(operator, device).apply_free(there), operator.apply_free(x))
    assert close(device_preconditioner(preconditioner, device)(there), preconditioner(x))


@pytest.mark.parametrize("device", DEVICES)
def test_same_iterates(device):
    operator, preconditioner = build(3)
    b = np.random.default_rng(0).standard_normal(tuple(n - 2 for n in operator.space.shape))
    there = solve_on_device(operator, preconditioner, b, 1e-10, 100, device)
    here = conjugate_gradients(operator.apply_free, b, preconditioner, 1e-10, 100)
    assert there.converged
    assert there.iterations == here.iterations
    assert np.allclose(there.x, here.x, rtol=0.0, atol=1e-10 * np.abs(here.x).max())


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_an_absent_gpu_is_named():
    with pytest.raises(ValueError, match="no CUDA GPU"):
        solve_problem(benchmark_volume(2), Poisson(exact="x"), device="cuda")


def test_other_devices_are_refused():
    with pytest.raises(ValueError, match="device must be one of cpu, cuda"):
        solve_problem(benchmark_volume(2), Poisson(exact="x"), device="tpu")
