import numpy as np
import pytest

from parameterize.quality.rotations import cofactors_and_determinants, dots, least_eigenvalues, squared_norms


def random_matrices(seed=5):
    """As (m, 3, 3) and as (3, 3, m)."""
    matrices = np.random.default_rng(seed).normal(size=(50, 3, 3))
    return matrices, np.moveaxis(matrices, 0, -1).copy()


def test_cofactors_determinants_and_norms():
    matrices, batch = random_matrices()
    cofactors, determinants = cofactors_and_determinants(batch)
    assert determinants == pytest.approx(np.linalg.det(matrices))
    expected = np.linalg.inv(matrices).transpose(0, 2, 1) * determinants[:, None, None]
    assert np.moveaxis(cofactors, -1, 0) == pytest.approx(expected)
    assert squared_norms(batch) == pytest.approx((matrices**2).sum(axis=(1, 2)))


def test_inner_products_of_vectors():
    _, batch = random_matrices()
    assert dots(batch[0], batch[1]) == pytest.approx((batch[0] * batch[1]).sum(axis=0))


@pytest.mark.parametrize(("dtype", "error"), [(np.float32, 1e-5), (np.float64, 1e-7)])
def test_least_eigenvalues_of_symmetric_matrices(dtype, error):
    a, _ = random_matrices()
    symmetric = np.concatenate([a + np.swapaxes(a, 1, 2), 2.0 * np.eye(3)[None], np.zeros((1, 3, 3))])
    found = least_eigenvalues(np.moveaxis(symmetric, 0, -1).astype(dtype))
    assert found.dtype == dtype
    assert found == pytest.approx(np.linalg.eigvalsh(symmetric)[:, 0], abs=error)
