import numpy as np
import pytest
import torch

from parameterize.quality.rotations import closest_rotations
from parameterize.training.losses import closest_rotation, cofactor, determinant


def test_determinants_cofactors_and_rotations_of_tensors():
    matrices = np.random.default_rng(5).normal(size=(10, 3, 3))
    batch = torch.as_tensor(np.moveaxis(matrices, 0, -1).copy())
    assert determinant(batch).numpy() == pytest.approx(np.linalg.det(matrices))
    expected = np.linalg.inv(matrices).transpose(0, 2, 1) * np.linalg.det(matrices)[:, None, None]
    assert np.moveaxis(cofactor(batch).numpy(), -1, 0) == pytest.approx(expected)
    assert np.array_equal(closest_rotation(batch.requires_grad_()), closest_rotations(batch.detach().numpy()))
