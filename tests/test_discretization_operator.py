import numpy as np
import pytest
from volumes import mapped, scalar_system

from parameterize.spline.bspline import collocation
from parameterize.spline.orientation import mirrored
from parameterize.spline.volume import BSplineVolume
from solve import Elasticity, Form, Poisson
from solve.discretization.operator import FormOperator, assemble
from solve.discretization.quadrature import gauss_rule, operator_rule
from solve.discretization.space import trial_space
from solve.discretization.stack import colours
from solve.study import benchmark_volume


def assemble_dense(volume, space, rule, source, kappa=lambda x: np.eye(3), reaction=lambda x: 0.0):
    """Matrix and load vector from dense tables of every basis function at every point; kappa (3, 3), reaction of x."""
    points = np.stack(np.meshgrid(*rule.points, indexing="ij"), axis=-1).reshape(-1, 3)
    weights = np.einsum("i,j,k->ijk", *rule.weights).ravel()
    tables = [
        [collocation(space.knots[a], space.degrees[a], rule.points[a], d).toarray() for d in (0, 1)] for a in range(3)
    ]

    def basis(*derivative):
        return np.kron(np.kron(tables[0][derivative[0]], tables[1][derivative[1]]), tables[2][derivative[2]])

    jacobian = volume.jacobian(points)
    measure = weights * np.linalg.det(jacobian)
    parametric = np.stack([basis(1, 0, 0), basis(0, 1, 0), basis(0, 0, 1)], axis=-1)  # (q, n, 3)
    gradient = np.einsum("qni,qij->qnj", parametric, np.linalg.inv(jacobian))
    where = volume(points)
    tensor, c = np.array([kappa(x) for x in where]), np.array([reaction(x) for x in where])
    flux = np.einsum("qij,qnj->qni", tensor, gradient)
    matrix = np.einsum("q,qni,qmi->nm", measure, flux, gradient, optimize=True)
    values = basis(0, 0, 0)
    matrix += np.einsum("q,qn,qm->nm", measure * c, values, values, optimize=True)
    return matrix, values.T @ (measure * source(*where.T))


@pytest.fixture(
    scope="module", params=[(1, None), (2, None), (3, None), (2, 3), (3, 1)], ids=lambda p: f"map{p[0]}-degree{p[1]}"
)
def case(request):
    own, degree = request.param
    rng = np.random.default_rng(0)
    smooth = benchmark_volume(2, own)
    stretched = smooth.control_points * [1.0, 2.0, 0.5] + 0.02 * rng.standard_normal(smooth.control_points.shape)
    volume = BSplineVolume.uniform(stretched[:, : own + 1], own) if own == 3 else BSplineVolume.uniform(stretched, own)
    space = trial_space(volume, degree=degree)
    rule = operator_rule(space, "spline")

    def source(x, y, z):
        return x * y + np.sin(z)

    return *scalar_system(volume, space, source), *assemble_dense(volume, space, rule, source)


def test_operator_equals_the_assembled_matrix(case):
    operator, _, matrix, _ = case
    x = np.random.default_rng(1).standard_normal(operator.space.shape)
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-12 * np.abs(expected).max())


def test_diagonal_equals_that_of_the_assembled_matrix(case):
    operator, _, matrix, _ = case
    assert np.allclose(operator.diagonal().ravel(), np.diag(matrix), rtol=1e-12)


def test_load_equals_the_assembled_vector(case):
    _, load, _, expected = case
    assert np.allclose(load.ravel(), expected, atol=1e-13 * np.abs(expected).max())


def test_interior_product_is_the_full_one_with_zero_boundary():
    stiffness = scalar_system(benchmark_volume(3))[0]
    x = np.zeros(stiffness.space.shape)
    x[1:-1, 1:-1, 1:-1] = np.random.default_rng(2).standard_normal((4, 4, 4))
    assert np.array_equal(stiffness.apply_free(x[1:-1, 1:-1, 1:-1]), stiffness.apply(x)[1:-1, 1:-1, 1:-1])


def test_symmetric_positive_and_constants_in_the_kernel():
    volume = benchmark_volume(4)
    stiffness = scalar_system(volume)[0]
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((2, *stiffness.space.shape))
    assert np.vdot(a, stiffness.apply(b)) == pytest.approx(np.vdot(b, stiffness.apply(a)), rel=1e-12)
    assert np.vdot(a, stiffness.apply(a)) > 0.0
    assert np.abs(stiffness.apply(np.ones_like(a))).max() < 1e-12


def test_linear_functions_are_in_balance_inside_a_curved_map_once_the_rule_is_exact():
    """The integrand has degree 3 p - 1 per direction: 5 Gauss points for p = 3."""
    volume = benchmark_volume(4)
    space = trial_space(volume)
    stiffness = scalar_system(volume, rule=gauss_rule(space, (5, 5, 5)))[0]
    for component in range(3):
        inside = stiffness.apply(volume.control_points[..., component])[1:-1, 1:-1, 1:-1]
        assert np.abs(inside).max() < 1e-13


def test_folded_points_are_counted_and_a_flat_map_is_refused():
    smooth, folded = benchmark_volume(4), benchmark_volume(4, amplitude=0.4)
    assert scalar_system(smooth)[0].folded == scalar_system(mirrored(smooth))[0].folded == 0
    operator, _ = scalar_system(folded)
    assert operator.folded == scalar_system(mirrored(folded))[0].folded
    u, v, w = operator.rule.points
    assert operator.folded == np.count_nonzero(np.linalg.det(folded.grid_jacobian(u, v, w)) < 0.0) > 0
    flat = BSplineVolume(smooth.degrees, smooth.knots, 0.0 * smooth.control_points)
    with pytest.raises(ValueError, match=r"det J is zero at the parameters \(0\.0\d"):
        scalar_system(flat)


TENSOR = [
    lambda x, y, z: 2.0 + x,
    lambda x, y, z: 0.3 * y,
    lambda x, y, z: 0.0,
    lambda x, y, z: 1.5 + z * z,
    lambda x, y, z: 0.1,
    lambda x, y, z: 1.0 + y,
]


@pytest.mark.parametrize("kappa", [lambda x, y, z: 1.0 + x * x, TENSOR], ids=["scalar", "tensor"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_coefficients_equal_the_assembled_matrix(kappa, degree):
    volume = benchmark_volume(2)
    space = trial_space(volume, degree=degree)

    def dense_kappa(x):
        if callable(kappa):
            return kappa(*x) * np.eye(3)
        xx, xy, xz, yy, yz, zz = (entry(*x) for entry in kappa)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def reaction(x, y, z):
        return 3.0 + x - y

    operator = scalar_system(volume, space, kappa=kappa, reaction=reaction)[0]
    matrix, _ = assemble_dense(volume, space, operator.rule, lambda x, y, z: x, dense_kappa, lambda p: reaction(*p))
    x = np.random.default_rng(1).standard_normal(space.shape)
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-12 * np.abs(expected).max())
    assert np.allclose(operator.diagonal().ravel(), np.diag(matrix), rtol=1e-12)


def test_window_leaves_out_the_faces_with_dirichlet_data():
    volume = benchmark_volume(2)
    assert trial_space(volume).free == (slice(1, 4),) * 3
    assert trial_space(volume, dirichlet=()).free == (slice(0, 5),) * 3
    assert trial_space(volume, dirichlet={"u1", "w0"}).free == (slice(0, 4), slice(0, 5), slice(1, 5))


UNEQUAL = mapped(
    lambda u, v, w: (u + 0.1 * np.sin(3.0 * v), v + 0.1 * u * w, 0.7 * w + 0.1 * u * u), (4, 3, 5), (1, 2, 3)
)


class Full(Form):
    """Two components that all couple: u, its gradient and x meet in flux and reaction."""

    components = 2
    symmetric = False

    def flux(self, u, grad, x):
        drift = np.stack([x[0] * u, u[::-1], 0.3 * u], axis=1)
        return np.einsum("ab,bi...->ai...", [[2.0, 0.5], [0.1, 1.0]], grad) + 0.2 * grad[:, ::-1] + drift

    def react(self, u, grad, x):
        return 3.0 * u + x[1] * u[::-1] + grad[:, 2] - 0.5 * grad[::-1, 0]


def dense_of_law(volume, form, space, rule):
    """The matrix (c n, c n) of a law, a column a basis function of a component."""
    points = np.stack(np.meshgrid(*rule.points, indexing="ij"), axis=-1).reshape(-1, 3)
    tables = [
        [collocation(space.knots[a], space.degrees[a], rule.points[a], d).toarray() for d in (0, 1)] for a in range(3)
    ]

    def basis(*derivative):
        return np.kron(np.kron(tables[0][derivative[0]], tables[1][derivative[1]]), tables[2][derivative[2]])

    jacobian, values = volume.jacobian(points), basis(0, 0, 0)
    measure = np.einsum("i,j,k->ijk", *rule.weights).ravel() * np.abs(np.linalg.det(jacobian))
    parametric = np.stack([basis(1, 0, 0), basis(0, 1, 0), basis(0, 0, 1)], axis=-1)
    gradient = np.einsum("qni,qij->qnj", parametric, np.linalg.inv(jacobian))
    c, n = form.components, space.dofs
    matrix = np.empty((c, n, c, n))
    for d in range(c):
        for j in range(n):
            u, grad = np.zeros((c, len(points))), np.zeros((c, 3, len(points)))
            u[d], grad[d] = values[:, j], gradient[:, j].T
            flux, react = form.flux(u, grad, volume(points).T), form.react(u, grad, volume(points).T) + 0.0 * u
            matrix[:, :, d, j] = np.einsum("q,aiq,qni->an", measure, flux, gradient, optimize=True)
            matrix[:, :, d, j] += (react * measure) @ values
    return matrix.reshape(c * n, c * n)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(
    "form", [Full(), Elasticity(exact=("x", "y", "z"), young=3.0), Poisson(kappa="1+x*x", reaction="2+y")],
    ids=["two components", "elasticity", "poisson as any law"],
)  # fmt: skip
def test_product_equals_the_matrix_with_unequal_degrees(form, threads):
    space = trial_space(UNEQUAL, refine=1)
    rule = gauss_rule(space)
    operator = assemble(UNEQUAL, space, form, None, rule, component=None, threads=threads)[0]
    assert isinstance(operator, FormOperator)
    matrix = dense_of_law(UNEQUAL, form, space, rule)
    x = np.random.default_rng(1).standard_normal((form.components, *space.shape))
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-11 * np.abs(expected).max())
    free = operator.space.window
    x[:, 0], x[:, -1], x[:, :, 0], x[:, :, -1], x[..., 0], x[..., -1] = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    assert np.allclose(operator.apply_free(x[:, *free]), operator.apply(x)[:, *free], atol=1e-12)
    if form.symmetric:  # without coupling of u and its gradient, which the blocks leave out
        blocks = [operator.block(c).diagonal().ravel() for c in range(form.components)]
        assert np.allclose(np.concatenate(blocks), np.diag(matrix), rtol=1e-10)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_six_factors_equal_the_matrix_with_unequal_degrees(threads):
    space = trial_space(UNEQUAL, refine=1)
    law = {"kappa": ("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z"), "reaction": "1+x*x"}
    form = Poisson(**law)
    operator = assemble(UNEQUAL, space, form, None, threads=threads)[0]
    x = np.random.default_rng(1).standard_normal(space.shape)
    expected = (dense_of_law(UNEQUAL, form, space, operator.rule) @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("degree", [1, 3, 5])
@pytest.mark.parametrize("layers", [1, 4, 5, 27])
def test_pieces_cover_all_layers_and_those_of_one_colour_share_no_function(degree, layers):
    both = colours(np.arange(layers), degree, 10)
    assert np.array_equal(np.sort(np.concatenate([*both[0], *both[1]])), np.arange(layers))
    for pieces in both:
        for before, after in zip(pieces, pieces[1:], strict=False):
            assert after[0] > before[-1] + degree  # function i lives on the spans i - degree to i


def test_points_of_one_layer_stay_together_whatever_their_number():
    pieces, others = colours(np.repeat(np.arange(10), [3, 1, 0, 2, 5, 1, 1, 1, 1, 1]), 3, 10)
    assert [piece.tolist() for piece in pieces] == [list(range(11)), [15]]
    assert [piece.tolist() for piece in others] == [[11, 12, 13, 14]]


@pytest.mark.parametrize(("threads", "shares"), [(1, 1), (2, 8), (50, 13)])
def test_pieces_of_one_colour_are_joined_to_some_shares_a_thread(threads, shares):
    both, alone = colours(np.arange(104), 3, threads), colours(np.arange(104), 3, 100)
    for joined, pieces in zip(both, alone, strict=True):
        assert len(joined) == shares and len(pieces) == 13
        assert np.array_equal(np.sort(np.concatenate(joined)), np.concatenate(pieces))
