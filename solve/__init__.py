"""Isogeometric solver on a B-spline volume: Poisson's problem and elasticity, their errors, convergence studies."""

from .elastic_problem import Elasticity
from .elasticity import check_elastic_data, solve_elasticity
from .expressions import Expression, ExpressionError
from .failure import ConvergenceError
from .field import SplineField
from .poisson import check_data, check_device, solve_poisson
from .problem import Poisson
from .report import SolveReport
from .solution import Solution
from .solver import check_problem, solve_problem
from .study import ConvergenceRow, benchmark_volume, convergence, rates

__all__ = [
    "ConvergenceError",
    "ConvergenceRow",
    "Elasticity",
    "Expression",
    "ExpressionError",
    "Poisson",
    "Solution",
    "SolveReport",
    "SplineField",
    "benchmark_volume",
    "check_data",
    "check_device",
    "check_elastic_data",
    "check_problem",
    "convergence",
    "rates",
    "solve_elasticity",
    "solve_poisson",
    "solve_problem",
]
