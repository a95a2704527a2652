"""Isogeometric solver on a B-spline volume F: linear second-order PDEs, their errors, convergence studies.

Law (`forms`). A `Form` gives a flux and a reaction, linear in u and its gradient. On the image of the cube, with data
on its six faces u0, u1, v0, v1, w0, w1,

    -div flux + react = f,     u = g,    flux . n = g,    or    flux . n + alpha u = g,

and in weak form, tests v zero where u is given,

    int flux : grad v + react . v + int_Robin alpha u . v  =  int f . v + int_Neumann g . v + int_Robin g . v.

`Poisson`: flux = kappa grad u, react = c u. `Elasticity`: flux = sigma = 2 mu eps + lambda tr(eps) I with
eps = (grad u + grad u^T) / 2, mu = E / (2 (1 + nu)), lambda = E nu / ((1 + nu) (1 - 2 nu)).

Discretisation (`discretization`). The trial space holds the splines of F's own degrees and knots, every
span halved `refine` times, or of another `degree`; F itself stays as it is. With J the derivative of F,

    int grad v . kappa grad u dx = int (grad v)^T G (grad u) d(u, v, w),    G = det J  J^-1 kappa J^-T,

gradients by the parameters on the right. Integrals are taken by Gauss rules of spline spaces S^d_(p-2), of degree d and
one derivative less smooth than the trial functions: (d - p + 2) / 2 points a span and direction. d is 2 p - 1 where G
varies little from span to span, as on smooth maps (p = 2: Gauss points on every span instead); else 2 p, from p = 4 on
2 p + 1. Directions in which functions are only continuous have p + 1 Gauss points a span. The matrix A is not
assembled. Of a scalar symmetric law six numbers of G a point are kept, and sum factorization applies it; any other law
is called on planes of points, between sum factorizations. Given values of u are interpolated at the cube's corners, and
projected in L2 on its edges, then on its faces.

Preconditioner (`linear`; Sangalli, Tani, SIAM J. Sci. Comput. 38, 2016). Each component has its own, from the flux of
unit gradients. G is replaced by its diagonal, and that by products of functions of one parameter, fitted in the sense
of least squares of logarithms:

    G_dd(t_1, t_2, t_3)  ~  a_d(t_d) b_e(t_e) b_f(t_f)        e, f: the two other directions
    K_d = int a_d N_i' N_j',    M_d = int b_d N_i N_j,    K_d U_d = M_d U_d L_d,    U_d^T M_d U_d = I.

With (x) the Kronecker product, U = U_1 (x) U_2 (x) U_3, c_0 an average of the reaction, and averages of Robin's alpha
added to the K_d,

    P = K_1 (x) M_2 (x) M_3 + M_1 (x) K_2 (x) M_3 + M_1 (x) M_2 (x) K_3 + c_0 M_1 (x) M_2 (x) M_3
    P^-1 = U (L_1 (+) L_2 (+) L_3 + c_0)^-1 U^T    a diagonal matrix: the sums of one eigenvalue of each direction
    A^-1 ~ D P^-1 D,    D^2 = diag(P) / diag(A).

It costs three small matrix products each way. Conjugate gradients (`linear.cg`), or GMRES where the law is not
symmetric, end at |r| <= tolerance |b|.

Errors (`norms`, `estimate`, `study`). Against an exact solution with p + 2 Gauss points a span and direction; for
smooth solutions the L2 norm falls like h^(p + 1), the H1 seminorm like h^p. Without one the L2 norm is estimated from
the residual, which for Poisson's problem is close to kappa (2 pi / h)^2 times the error.

Formulas (`forms`). Beside x, y, z they know X, Y, Z: with c the middle of F's bounding box and V its
volume, (X, Y, Z) = ((x, y, z) - c) / V^(1/3). `meaning` finds data that do not vary on the domain.

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

from .failure import ConvergenceError
from .field import SplineField
from .forms.elasticity import Elasticity
from .forms.form import Form
from .forms.parser import Expression, ExpressionError
from .forms.poisson import Poisson
from .forms.problem import Problem
from .report import SolveReport
from .solution import Solution
from .solver import check_problem, discretize, solve_problem
from .study import ConvergenceRow, benchmark_volume, convergence, rates
from .system import System, check_device

__all__ = [
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
