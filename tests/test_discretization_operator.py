import numpy as np
import pytest
from volumes import scalar_system

from parameterize.spline.bspline import collocation
from parameterize.spline.volume import BSplineVolume
from solve.discretization.operator import free_window
from solve.discretization.quadrature import gauss_rule, operator_rule
from solve.discretization.space import trial_space
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
    rule = operator_rule(space)

    def source(x, y, z):
        return x * y + np.sin(z)

    return scalar_system(volume, space, source), *assemble_dense(volume, space, rule, source)


def test_operator_equals_the_assembled_matrix(case):
    system, matrix, _ = case
    x = np.random.default_rng(1).standard_normal(system.operator.space.shape)
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(system.operator.apply(x), expected, atol=1e-12 * np.abs(expected).max())


def test_diagonal_equals_that_of_the_assembled_matrix(case):
    system, matrix, _ = case
    assert np.allclose(system.operator.diagonal().ravel(), np.diag(matrix), rtol=1e-12)


def test_load_equals_the_assembled_vector(case):
    system, _, load = case
    assert np.allclose(system.load.ravel(), load, atol=1e-13 * np.abs(load).max())


def test_interior_product_is_the_full_one_with_zero_boundary():
    stiffness = scalar_system(benchmark_volume(3)).operator
    x = np.zeros(stiffness.space.shape)
    x[1:-1, 1:-1, 1:-1] = np.random.default_rng(2).standard_normal((4, 4, 4))
    assert np.array_equal(stiffness.apply_free(x[1:-1, 1:-1, 1:-1]), stiffness.apply(x)[1:-1, 1:-1, 1:-1])


def test_symmetric_positive_and_constants_in_the_kernel():
    volume = benchmark_volume(4)
    stiffness = scalar_system(volume).operator
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((2, *stiffness.space.shape))
    assert np.vdot(a, stiffness.apply(b)) == pytest.approx(np.vdot(b, stiffness.apply(a)), rel=1e-12)
    assert np.vdot(a, stiffness.apply(a)) > 0.0
    assert np.abs(stiffness.apply(np.ones_like(a))).max() < 1e-12


def test_linear_functions_are_in_balance_inside_a_curved_map_once_the_rule_is_exact():
    """The integrand has degree 3 p - 1 per direction: 5 Gauss points for p = 3."""
    volume = benchmark_volume(4)
    space = trial_space(volume)
    stiffness = scalar_system(volume, rule=gauss_rule(space, (5, 5, 5))).operator
    for component in range(3):
        inside = stiffness.apply(volume.control_points[..., component])[1:-1, 1:-1, 1:-1]
        assert np.abs(inside).max() < 1e-13


def test_folded_points_are_counted_and_a_flat_map_is_refused():
    smooth = benchmark_volume(4)
    mirrored = BSplineVolume(smooth.degrees, smooth.knots, smooth.control_points * [1.0, 1.0, -1.0])
    system = scalar_system(mirrored)
    assert system.folded == system.points == np.prod(system.operator.rule.shape)
    assert scalar_system(smooth).folded == 0
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

    operator = scalar_system(volume, space, kappa=kappa, reaction=reaction).operator
    matrix, _ = assemble_dense(volume, space, operator.rule, lambda x, y, z: x, dense_kappa, lambda p: reaction(*p))
    x = np.random.default_rng(1).standard_normal(space.shape)
    expected = (matrix @ x.ravel()).reshape(x.shape)
    assert np.allclose(operator.apply(x), expected, atol=1e-12 * np.abs(expected).max())
    assert np.allclose(operator.diagonal().ravel(), np.diag(matrix), rtol=1e-12)


def test_window_leaves_out_the_faces_with_dirichlet_data():
    space = trial_space(benchmark_volume(2))
    assert free_window(space) == (slice(1, 4),) * 3
    assert free_window(space, ()) == (slice(0, 5),) * 3
    assert free_window(space, {"u1", "w0"}) == (slice(0, 4), slice(0, 5), slice(1, 5))
    with pytest.raises(ValueError, match="'top' is no face"):
        free_window(space, {"top"})
