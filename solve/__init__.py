"""Isogeometric solver on a B-spline volume F: linear second-order PDEs, their errors, convergence studies.

`forms` describes laws and their data; `discretization` has the trial space, its quadrature and the product without a
matrix, `linear` conjugate gradients and their preconditioner; `diagnostics` says when numbers are not to be trusted.
The formulas stand in docs/solver.md.

>>> from solve import Form, Poisson, Problem, benchmark_volume, convergence
>>> rows = convergence(benchmark_volume(2), Poisson(exact="exp(X+Z)*sin(Y)"), refine=range(3))
>>> [row.report.dofs for row in rows]
[125, 343, 1331]
>>> rows[-1].rate_l2 > 3.5, rows[-1].rate_h1 > 2.5
(True, True)
>>> class Law(Form):
...     def flux(self, u, grad, x):
...         return (1 + x[0] ** 2) * grad
>>> convergence(benchmark_volume(2), Problem(Law(), exact="exp(x)*y*z"), refine=range(3))[-1].rate_l2 > 3.5
True
"""

from .diagnostics import ConvergenceError
from .field import SplineField
from .forms.elasticity import Elasticity
from .forms.form import Form
from .forms.parser import Expression, ExpressionError
from .forms.poisson import Poisson
from .forms.problem import Problem
from .solution import Solution, SolveReport
from .solver import check_problem, discretize, solve_problem
from .study import Convergence, ConvergenceRow, benchmark_volume, convergence, rates
from .system import System, check_device

__all__ = [
    "Convergence",
    "ConvergenceError",
    "ConvergenceRow",
    "Elasticity",
    "Expression",
    "ExpressionError",
    "Form",
    "Poisson",
    "Problem",
    "Solution",
    "SolveReport",
    "SplineField",
    "System",
    "benchmark_volume",
    "check_device",
    "check_problem",
    "convergence",
    "discretize",
    "rates",
    "solve_problem",
]
