"""The factor by fronts solves as a dense one, in an order with little fill, and tells what is not positive."""

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array, eye_array, kron
from scipy.sparse.linalg import splu

from solve.linear.cholesky import cholesky, touching
from solve.linear.dissection import ROOT, Dissection


def grid(*counts):
    """Return Laplace's matrix on a grid, with neighbours across corners, and the points."""
    axes = [np.arange(n) / n for n in counts]
    rows = [diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]) for n in counts]
    masses = [eye_array(n) * 6.0 - row for n, row in zip(counts, rows, strict=True)]
    u, v, w = zip(rows, masses, strict=True)
    terms = (kron(kron(u[a], v[b]), w[c]) for a, b, c in ((0, 1, 1), (1, 0, 1), (1, 1, 0)))
    return csc_array(sum(terms)), np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def factor_of(matrix, points):
    return cholesky(matrix, Dissection.of(touching(matrix, len(points)), points))


@pytest.mark.parametrize("components", [1, 3])
def test_it_solves(components):
    rng = np.random.default_rng(0)
    matrix, points = grid(9, 7, 8)
    mixed = np.eye(components) + 0.1
    matrix, shuffled = csc_array(kron(mixed, matrix)), rng.permutation(len(points))
    order = (shuffled + len(points) * np.arange(components)[:, None]).ravel()
    matrix = matrix[order][:, order].tocsc()
    factor, right = factor_of(matrix, points[shuffled]), rng.standard_normal((matrix.shape[0], 2))
    assert factor(right) == pytest.approx(np.linalg.solve(matrix.toarray(), right), abs=1e-11)
    assert factor(right[:, 0]) == pytest.approx(factor(right)[:, 0])


def test_parts_without_a_common_entry_have_trees_of_their_own():
    matrix, points = grid(4, 4, 4)
    both, right = csc_array(kron(eye_array(2), matrix)), np.arange(128.0)
    tree = Dissection.of(touching(both, 128), np.concatenate([points, points + 2.0]))
    assert np.count_nonzero(tree.parents == ROOT) >= 2
    assert both @ cholesky(both, tree)(right) == pytest.approx(right)


@pytest.mark.parametrize("counts", [(1, 1, 1), (1, 1, 3), (40, 1, 1)])
def test_few_unknowns_are_one_front_and_lines_many(counts):
    matrix, points = grid(*counts)
    right = np.ones(len(points))
    assert matrix @ factor_of(matrix, points)(right) == pytest.approx(right)


def test_a_matrix_that_is_not_positive_has_no_factor():
    matrix, points = grid(6, 6, 6)
    assert factor_of(matrix - 50.0 * eye_array(216), points) is None


def test_the_order_has_no_more_fill_than_that_of_least_degrees():
    """Zeros that dense fronts keep are counted, too."""
    matrix, points = grid(16, 16, 16)
    factor = factor_of(matrix, points)
    known = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    assert len(factor.entries) < known.L.nnz
