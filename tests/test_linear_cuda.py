from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cube_grids import row_of  # noqa: E402

import iga_nn  # noqa: E402
from parameterize.conjugate_gradients import conjugate_gradients  # noqa: E402
from parameterize.spline.volume import FACE_NAMES  # noqa: E402
from solve import Poisson, benchmark_volume, solve_problem  # noqa: E402
from solve.linear.cuda import solve_on_device  # noqa: E402
from solve.linear.device_matrix import DeviceMatrix  # noqa: E402

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))]


PROBLEMS = {
    "scalar": iga_nn.Poisson(source="1+x", kappa={0: "1+x", 1: 2, 2: 3, 3: 1}, reaction="x", robin={"v1": ("2", "x")}),
    "elastic": iga_nn.Elasticity(
        body_force=("0", "0", "1"), young={0: 1, 1: 9, 2: 3, 3: 4}, fix="x < .1", spring={"v1": 3}
    ),
}


def close(found, wanted, tolerance=1e-10):
    return np.allclose(found, wanted, rtol=0.0, atol=tolerance * np.abs(wanted).max())


def demand_same_solution(system, device):
    here = conjugate_gradients(system.product, system.right, system.precondition, 1e-12, 300)
    system_there = system.unknowns, system.matrix, system.inverse, system.right
    there = solve_on_device(*system_there, 1e-12, 300, device)
    again = solve_on_device(*system_there, 1e-12, 300, device, start=there.x)
    assert here.converged and there.converged and again.iterations <= 1
    assert abs(there.iterations - here.iterations) <= 1
    assert close(there.x, here.x)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("counts", [(3, 4, 3, 3), (4,) * 4], ids=["a shape of its own", "one shape"])
def test_a_body_of_several_patches_is_solved_as_on_the_cpu(device, name, counts, monkeypatch):
    monkeypatch.setattr("solve.linear.multigrid.SMALL", 20)
    system = iga_nn.discretize(row_of(counts), PROBLEMS[name], refine=1)
    assert len(system.inverse.cycle.levels) > 1
    demand_same_solution(system, device)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    "problem",
    [
        iga_nn.Poisson(source="x", reaction="1+y", neumann={"u1": "y", "v0": "0"}),
        iga_nn.Poisson(exact="x*y+z", neumann=dict.fromkeys(FACE_NAMES)),
        iga_nn.Elasticity(exact=("x*y", "z", "x*x")),
        iga_nn.Elasticity(exact=("x*y", "z", "x*x"), traction=dict.fromkeys(FACE_NAMES[1:])),
    ],
    ids=["held", "open", "held elastic", "rod"],
)
def test_a_cube_is_solved_as_on_the_cpu(device, problem):
    demand_same_solution(iga_nn.discretize(benchmark_volume(4), problem, refine=1), device)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("piece_bytes", [1, 5000, 2**28], ids=["layer by layer", "in pieces", "at once"])
def test_same_products_as_the_compiled_kernels(device, name, piece_bytes, monkeypatch):
    monkeypatch.setattr("solve.linear.device_matrix.PIECE_BYTES", piece_bytes)
    matrix = iga_nn.discretize(row_of((3, 4, 3, 3)), PROBLEMS[name], refine=1).matrix
    x = matrix.layout.empty(matrix.laws[0].form.components)
    x.flat[:] = np.random.default_rng(0).standard_normal(len(x.flat))
    there = replace(x, flat=torch.as_tensor(x.flat, device=device))
    assert close(DeviceMatrix(matrix, device).apply(there).flat.cpu().numpy(), matrix.apply(x).flat, 1e-12)


def test_a_law_that_is_called_at_the_points_is_refused():
    class Coupled(iga_nn.Form):
        def flux(self, u, grad, x):
            return grad + u[:, None] * np.array([1.0, 0.0, 0.0]).reshape(3, *(1,) * (u.ndim - 1))

        def react(self, u, grad, x):
            return 2.0 * u + grad[:, 0]

    system = iga_nn.discretize(benchmark_volume(2), iga_nn.Problem(Coupled(), source="1"))
    with pytest.raises(ValueError, match="Coupled is solved on device='cpu' only.*its flux is not constant"):
        solve_on_device(system.unknowns, system.matrix, system.inverse, system.right, 1e-10, 10, "cpu")


def test_a_mixed_system_is_refused():
    law = iga_nn.Elasticity(exact=("x", "y", "z"), poisson_ratio=0.49)
    with pytest.raises(ValueError, match="'mixed' is solved on device='cpu' only, got device='cuda'"):
        iga_nn.discretize(benchmark_volume(2), law).solve(device="cuda")


def test_several_processes_are_refused(monkeypatch):
    monkeypatch.setattr("solve.system.check_device", lambda device, problem: None)  # as if there were a GPU
    both = SimpleNamespace(processes=SimpleNamespace(shared=lambda value: [value, value]))
    system = replace(iga_nn.discretize(benchmark_volume(2), Poisson(exact="x")), unknowns=both)
    with pytest.raises(ValueError, match="several processes solve on device='cpu' only, got device='cuda'"):
        system.solve(device="cuda")


def test_a_law_that_is_not_symmetric_is_refused():
    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):
            return grad

    with pytest.raises(ValueError, match="Wind is solved on device='cpu' only.*symmetric"):
        solve_problem(benchmark_volume(2), iga_nn.Problem(Wind(), source="1"), device="cuda")


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_an_absent_gpu_is_named():
    with pytest.raises(ValueError, match="no CUDA GPU"):
        solve_problem(benchmark_volume(2), Poisson(exact="x"), device="cuda")


def test_other_devices_are_refused():
    with pytest.raises(ValueError, match="device must be one of cpu, cuda"):
        solve_problem(benchmark_volume(2), Poisson(exact="x"), device="tpu")
