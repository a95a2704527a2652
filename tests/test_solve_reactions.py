"""Whole faces with Robin data answer the loads, as regions do."""

import pytest

import iga_nn
from parameterize.spline.volume import FACE_NAMES
from solve import benchmark_volume


@pytest.mark.parametrize("robin", [{"u1": ("2", "3")}, {"u0": ("2", "3"), "u1": ("1+y", "x")}])
def test_faces_with_robin_data_answer_the_loads(robin):
    volume = benchmark_volume(2)
    problem = iga_nn.Poisson(source="1", neumann={name: "0" for name in FACE_NAMES if name not in robin}, robin=robin)
    balance = iga_nn.solve(volume, problem, refine=1).report.balance
    assert set(balance.reactions) == set(robin) and balance.imbalance < 1e-8
    assert sum(force[0] for force in balance.reactions.values()) == pytest.approx(-balance.load[0], rel=1e-8)
    assert balance.load[0] == pytest.approx(iga_nn.integrate(volume), rel=1e-6)
