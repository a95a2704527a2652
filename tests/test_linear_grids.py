"""Coarser grids on graded knots: the finest grading goes first, and iterations do not depend on its depth."""

import numpy as np
import pytest
from cube_grids import box, glued
from test_discretization_grading import towards
from test_linear_low_order import elastic, iterations

import iga_nn
from parameterize.spline.body import as_body
from solve.discretization.grading import Grading
from solve.discretization.space import trial_space
from solve.discretization.unknowns import Glued
from solve.linear import multigrid
from solve.linear.grids import Grid


def test_the_finest_spans_go_first_and_the_others_stay():
    volume = box((0, 0, 0), 2, 1)
    places = towards(volume, 0, 4).places(0)
    grid = Grid.of(as_body(volume), Glued.of([trial_space(volume, places=places, dirichlet=())], ()))
    rows = []
    while (grid := grid.coarser()) is not None:
        rows.append([row[1:-1].tolist() for row in grid.unknowns.spaces[0].knots])
    sixteenths = [[0, 1, 2, 4, 8, 16], [0, 2, 4, 8, 16], [0, 4, 8, 16], [0, 8, 16], [0, 16]]
    assert [np.multiply(row[0], 16).tolist() for row in rows][-5:] == sixteenths
    assert all(row[1] == [0, 0.5, 1] for row in rows[:-1]) and rows[-1][1] == [0, 1]


@pytest.mark.parametrize("problem", [iga_nn.Poisson(source="1"), elastic(fix="p0_u0")])
def test_iterations_do_not_depend_on_the_depth_of_the_grading(problem, monkeypatch):
    monkeypatch.setattr(multigrid, "SMALL", 300)
    body = glued([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1, 2)  # the sheets at the re-entrant edge: x and y, both sides
    found = []
    for levels in (5, 10):
        grading = Grading.of(body)
        for _ in range(levels):
            last = {0: grading.spans[0] - 1, 1: grading.spans[1] - 1, 3: 0, 4: 0}
            grading = grading.refined({s: np.arange(grading.spans[s]) == place for s, place in last.items()})
        found.append(iterations(body, problem, grading=grading))
    assert found[1] <= 1.3 * found[0] and found[1] < 60, found
