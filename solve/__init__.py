"""Isogeometric solver on a B-spline volume F: Poisson's problem and elasticity, their errors, convergence studies.

Problem (`forms`). On the image of the cube, with data on its six faces u0, u1, v0, v1, w0, w1,

    -div(kappa grad u) + c u = f,     u = g,    kappa du/dn = g,    or    kappa du/dn + alpha u = g,

and in weak form, tests v zero where u is given,

    int grad v . kappa grad u + c v u + int_Robin alpha v u  =  int v f + int_Neumann v g + int_Robin v g.

Discretisation (`discretization`). The trial space holds the splines of F's own degrees and knots, every
span halved `refine` times, or of another `degree`; F itself stays as it is. With J the derivative of F,

    int grad v . kappa grad u dx = int (grad v)^T G (grad u) d(u, v, w),    G = det J  J^-1 kappa J^-T,

gradients by the parameters on the right. p Gauss points a span and direction integrate it (one more where functions are
only continuous). The matrix A is not assembled: six numbers of G a Gauss point are kept, and sum factorization applies
it. Given values of u are interpolated at the cube's corners, and projected in L2 on its edges, then on its faces.

Preconditioner (`linear`; Sangalli, Tani, SIAM J. Sci. Comput. 38, 2016). G is replaced by its diagonal, and that
by products of functions of one parameter, fitted in the sense of least squares of logarithms:

    G_dd(t_1, t_2, t_3)  ~  a_d(t_d) b_e(t_e) b_f(t_f)        e, f: the two other directions
    K_d = int a_d N_i' N_j',    M_d = int b_d N_i N_j,    K_d U_d = M_d U_d L_d,    U_d^T M_d U_d = I.

With (x) the Kronecker product, U = U_1 (x) U_2 (x) U_3, c_0 an average of the reaction, and averages of Robin's alpha
added to the K_d,

    P = K_1 (x) M_2 (x) M_3 + M_1 (x) K_2 (x) M_3 + M_1 (x) M_2 (x) K_3 + c_0 M_1 (x) M_2 (x) M_3
    P^-1 = U (L_1 (+) L_2 (+) L_3 + c_0)^-1 U^T    a diagonal matrix: the sums of one eigenvalue of each direction
    A^-1 ~ D P^-1 D,    D^2 = diag(P) / diag(A).

It costs three small matrix products each way. Conjugate gradients (`linear.cg`) end at |r| <= tolerance |b|.

Elasticity (`elasticity`). A displacement u of three components; eps = (grad u + grad u^T) / 2,

    -div sigma = f,    sigma = 2 mu eps + lambda tr(eps) I,    mu = E / (2 (1 + nu)),
    lambda = E nu / ((1 + nu) (1 - 2 nu)),    u = g    or    sigma n = t on a face;

the preconditioner is that of each component's own block.

Errors (`norms`, `estimate`, `study`). Against an exact solution with p + 2 Gauss points a span and direction; for
smooth solutions the L2 norm falls like h^(p + 1), the H1 seminorm like h^p. Without one the L2 norm is estimated from
the residual, which for Poisson's problem is close to kappa (2 pi / h)^2 times the error.

Formulas (`forms`). Beside x, y, z they know X, Y, Z: with c the middle of F's bounding box and V its
volume, (X, Y, Z) = ((x, y, z) - c) / V^(1/3). `meaning` finds data that do not vary on the domain.

>>> from solve import Poisson, benchmark_volume, convergence
>>> rows = convergence(benchmark_volume(2), Poisson(exact="exp(X+Z)*sin(Y)"), refine=range(3))
>>> [row.report.dofs for row in rows]
[125, 343, 1331]
>>> rows[-1].rate_l2 > 3.5, rows[-1].rate_h1 > 2.5
(True, True)
"""

from .elasticity import check_elastic_data, solve_elasticity
from .failure import ConvergenceError
from .field import SplineField
from .forms.elastic_problem import Elasticity
from .forms.formula import Expression, ExpressionError
from .forms.problem import Poisson
from .poisson import check_data, check_device, solve_poisson
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
