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

from typing import Any

from parameterize.old_names import renamed

from .answer import Answer as Answer
from .ask import Ask as Ask
from .diagnostics import ConvergenceError as ConvergenceError
from .discretization.grading import Grading as Grading
from .field import BodyField as BodyField
from .field import SplineField as SplineField
from .forms.elasticity import Elasticity as Elasticity
from .forms.form import Form as Form
from .forms.library import material as material
from .forms.material import Material as Material
from .forms.parser import Expression as Expression
from .forms.parser import ExpressionError as ExpressionError
from .forms.poisson import Poisson as Poisson
from .forms.problem import Problem as Problem
from .forms.region import Region as Region
from .integrals import integrate as integrate
from .integrals import resultant as resultant
from .march import March as March
from .march import march as march
from .modes import Modes as Modes
from .modes import modes as modes
from .newton import newton as newton
from .options import SolveOptions as SolveOptions
from .options import check_device as check_device
from .quantities import Extremes as Extremes
from .reactions import Balance as Balance
from .refinement.adaptive import Adapted as Adapted
from .refinement.adaptive import adaptive as adaptive
from .refinement.loop import Step as Step
from .singular import SingularPlace as SingularPlace
from .singular import SingularPlaces as SingularPlaces
from .solution import PatchSolution as PatchSolution
from .solution import Solution as Solution
from .solution import SolveReport as SolveReport
from .solver import check_problem as check_problem
from .solver import discretize as discretize
from .solver import solve_problem as solve_problem
from .solver import solve_with as solve_with
from .study import Convergence as Convergence
from .study import ConvergenceRow as ConvergenceRow
from .study import benchmark_volume as benchmark_volume
from .study import convergence as convergence
from .study import rates as rates
from .system import System as System


def __getattr__(name: str) -> Any:
    """Find a name of an earlier version (PEP 562)."""
    return globals()[renamed("solve", name)]
