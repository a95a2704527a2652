"""One entrance for both kinds of problem."""

from __future__ import annotations

from typing import Any

from parameterize.spline.volume import BSplineVolume

from .elasticity import check_elastic_data, solve_elasticity
from .forms.elastic_problem import Elasticity
from .forms.problem import Poisson
from .poisson import check_data, solve_poisson
from .solution import Solution


def solve_problem(volume: BSplineVolume, problem: Poisson | Elasticity, **options: Any) -> Solution:
    """`solve_poisson` or `solve_elasticity`, with their keywords."""
    if isinstance(problem, Elasticity):
        return solve_elasticity(volume, problem, **options)
    return solve_poisson(volume, problem, **options)


def check_problem(volume: BSplineVolume, problem: Poisson | Elasticity) -> None:
    """Evaluate a problem's data where the coarsest solve needs them. Raises ExpressionError as that solve would."""
    if isinstance(problem, Elasticity):
        check_elastic_data(volume, problem)
    else:
        check_data(volume, problem)
