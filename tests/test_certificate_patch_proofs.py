"""The search for a direction that proves, in cones and slabs as thin as those beside a sharp edge."""

import numpy as np
import pytest

from parameterize.certificate.patch_proofs import _apart, _half_space

ERROR = 1e-15


@pytest.mark.parametrize("thinness", [1.0, 1e-2, 1e-4])
def test_a_thin_cone_of_directions_is_found(thinness):
    """Vectors of unequal lengths beside the plane x = 0, nearly all within `thinness` of it."""
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(200, 30, 3)) * 10.0 ** rng.uniform(-3.0, 0.0, (200, 30, 1))
    vectors[..., 0] = thinness * np.linalg.norm(vectors[..., 1:], axis=-1) * rng.uniform(0.5, 1.0, (200, 30))
    turned = vectors @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    products = np.einsum("nkc,nc->nk", turned, _half_space(turned))
    assert (products > 0.0).all()


def test_where_there_is_no_such_direction_none_is_claimed():
    axes = np.concatenate([np.eye(3), -np.eye(3)])[None]
    assert (np.einsum("nkc,nc->nk", axes, _half_space(axes)) <= 0.0).any()


@pytest.mark.parametrize("size", [1.0, 1e-5])
@pytest.mark.parametrize("gap", [1e-3, -1e-3])
def test_two_flat_clouds_are_apart_or_not(size, gap):
    rng = np.random.default_rng(1)
    below, above = (size * rng.uniform(-1.0, 1.0, (50, 16, 3)) for _ in range(2))
    below[..., 2] *= 1e-3
    above[..., 2] *= 1e-3
    above[..., 2] += size * (2e-3 + gap)
    below[:, :3] = size * np.array([[-1.0, -1.0, 1e-3], [1.0, -1.0, 1e-3], [0.0, 1.0, 1e-3]])
    above[:, :3] = size * np.array([[-1.0, -1.0, 1e-3 + gap], [1.0, -1.0, 1e-3 + gap], [0.0, 1.0, 1e-3 + gap]])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    assert (_apart(0.3 + below @ turn, 0.3 + above @ turn, ERROR) == (gap > 0.0)).all()
