import numpy as np
import pytest

from parameterize.optimization.bending import bending_operator, grams
from parameterize.optimization.operators import ControlRows
from parameterize.optimization.tensor_product import GaussGrid, KroneckerInverse, along
from parameterize.spline.bspline import gauss_points, greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

DEGREES = (3, 2, 3)
KNOTS = (open_uniform_knots(6, 3), np.array([0.0, 0.0, 0.0, 0.3, 1.0, 1.0, 1.0]), open_uniform_knots(5, 3))
SHAPE = (3, 6, 4, 5)


def random_field(seed, shape=SHAPE):
    return np.random.default_rng(seed).normal(size=shape)


def as_volume(control):
    return BSplineVolume(DEGREES, KNOTS, np.moveaxis(control, 0, -1))


def points_and_weights(n_gauss):
    points, weights = zip(*(gauss_points(k, n_gauss) for k in KNOTS), strict=True)
    return [p.ravel() for p in points], np.einsum("i,j,k->ijk", *(w.ravel() for w in weights))


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_along_is_a_matrix_product_on_one_axis(axis):
    field = random_field(0)
    matrix = np.random.default_rng(1).normal(size=(7, SHAPE[axis]))
    expected = np.moveaxis(np.tensordot(matrix, field, axes=([1], [axis])), 0, axis)
    assert np.allclose(along(matrix, field, axis), expected, atol=1e-13)


def test_rows_and_their_transpose_are_those_of_the_matrix():
    rng = np.random.default_rng(0)
    columns, values = rng.permuted(np.tile(np.arange(6), (9000, 1)), axis=1)[:, :3], rng.normal(size=(9000, 3))
    dense = np.zeros((9000, 6))  # more than one piece of work
    np.put_along_axis(dense, columns, values, axis=1)
    rows, control = ControlRows(columns, values), random_field(8, (3, 1, 2, 3))
    assert rows(control) == pytest.approx(dense @ control.reshape(3, -1).T)
    dual = random_field(9, (9000, 3))
    assert rows.adjoint(dual, control).reshape(3, -1) == pytest.approx(dual.T @ dense)
    assert rows.in_single()(control.astype(np.float32)).dtype == np.float32
    nothing = ControlRows(np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3)))
    assert nothing(control).shape == (0, 3) and not nothing.adjoint(random_field(9, (0, 3)), control).any()


def test_jacobian_agrees_with_the_volume():
    grid = GaussGrid(KNOTS, DEGREES, 2)
    control = random_field(1)
    points, products = points_and_weights(2)
    expected = as_volume(control).grid_jacobian(*points)  # (m_u, m_v, m_w, 3, 3)
    found = [grid.jacobian(control, planes) for planes in grid.planes()]
    for i, j in np.ndindex(3, 3):
        entries = expected[..., i, j].transpose(0, 2, 1).reshape(grid.weights.shape)
        assert grid.by_planes([part[i, j] for part in found]) == pytest.approx(entries)
        for part, planes in zip(found, grid.planes(), strict=True):
            assert part[i, j] == pytest.approx(grid.flat(entries, planes))
    assert grid.weights == pytest.approx(products.transpose(0, 2, 1).reshape(len(products), -1))
    assert grid.weights.sum() == pytest.approx(1.0)


def test_values_of_points_and_spans():
    grid = GaussGrid(KNOTS, DEGREES, 3, inner=1)
    volumes = grid.sum_on_spans(grid.weights)
    assert np.allclose(volumes, np.einsum("i,j,k->ijk", *(np.diff(np.unique(k)) for k in KNOTS)), atol=1e-15)
    numbers = np.arange(volumes.size, dtype=np.float64).reshape(volumes.shape)
    assert np.allclose(grid.sum_on_spans(grid.at_points(numbers) * grid.weights), numbers * volumes, atol=1e-12)


def test_adjoint_identity():
    grid = GaussGrid(KNOTS, DEGREES, 2)
    x = random_field(2)
    images = [grid.jacobian(x, planes) for planes in grid.planes()]
    duals = [random_field(3, image.shape) for image in images]
    pulled = [grid.adjoint(y, planes) for y, planes in zip(duals, grid.planes(), strict=True)]
    products = sum(float((a * b).sum()) for a, b in zip(images, duals, strict=True))
    assert len(images) > 1
    assert products == pytest.approx(float((x * grid.collect(pulled, x)).sum()), rel=1e-12)


def test_bending_operator_against_quadrature():
    mass, slope, curve = grams(KNOTS, DEGREES)
    control = random_field(4)
    volume = as_volume(control)
    points, weights = points_and_weights(4)
    grid_points = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3)
    weights = weights.ravel()
    bends = (weights * (volume.hessian(grid_points) ** 2).sum(axis=(1, 2, 3))).sum()
    operator = bending_operator([mass, slope, curve], 0.7)
    assert float((control * operator(control)).sum()) == pytest.approx(0.7 * bends, rel=1e-10)


def test_bending_operator_is_symmetric_and_leaves_affine_maps_unbent():
    operator = bending_operator(grams(KNOTS, DEGREES), 0.2)
    x, y = random_field(5), random_field(6)
    assert float((x * operator(y)).sum()) == pytest.approx(float((y * operator(x)).sum()), rel=1e-12)
    rows = [greville(k, p) for k, p in zip(KNOTS, DEGREES, strict=True)]
    identity = np.stack(np.meshgrid(*rows, indexing="ij"))
    assert np.abs(operator(identity)).max() < 1e-10


def test_gram_integrates_exactly():
    mass, slope, _ = (matrices[0] for matrices in grams(KNOTS, DEGREES))
    assert float(mass.sum()) == pytest.approx(1.0)  # partition of unity
    x = greville(KNOTS[0], 3)
    assert float(x @ mass @ x) == pytest.approx(1.0 / 3.0)
    assert float(x @ slope @ x) == pytest.approx(1.0)


@pytest.mark.parametrize("shift", [0.0, 1.5])
def test_fast_diagonalization_is_the_inverse(shift):
    mass, slope, curve = grams(KNOTS, DEGREES)
    ends = [np.zeros_like(m) for m in mass]
    for e in ends:
        e[0, 0] = e[-1, -1] = 2.0
    rough = tuple(k + 0.1 * h + e for k, h, e in zip(slope, curve, ends, strict=True))
    solve = KroneckerInverse(rough, mass, shift)
    x = random_field(7)
    m0, m1, m2 = mass
    image = shift * along(m2, along(m1, along(m0, x, 1), 2), 3)
    for axis in range(3):
        term = x
        for other in range(3):
            term = along(rough[other] if other == axis else mass[other], term, other + 1)
        image = image + term
    assert np.allclose(solve(image), x, atol=1e-9)


def test_one_point_on_inner_spans():
    grid = GaussGrid(KNOTS, DEGREES, 3, inner=1)
    u, v, w = (spans - 2 + 2 * 3 if (spans := len(np.unique(k)) - 1) > 1 else spans for k in KNOTS)
    assert grid.weights.shape == (u, v * w)
    assert grid.weights.sum() == pytest.approx(1.0)
