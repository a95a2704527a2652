"""Isogeometric solver on a B-spline volume: Poisson's problem, its errors and convergence studies."""

from .expressions import Expression, ExpressionError
from .failure import ConvergenceError
from .field import SplineField
from .poisson import Solution, check_data, solve_poisson
from .problem import Poisson
from .report import SolveReport
from .study import ConvergenceRow, benchmark_volume, convergence, rates

__all__ = [
    "ConvergenceError",
    "ConvergenceRow",
    "Expression",
    "ExpressionError",
    "Poisson",
    "Solution",
    "SolveReport",
    "SplineField",
    "benchmark_volume",
    "check_data",
    "convergence",
    "rates",
    "solve_poisson",
]
