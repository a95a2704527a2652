import numpy as np
import pytest

from parameterize.certificate.boundary import check_boundary
from parameterize.spline.orientation import enclosed_volume, mirrored, orientation
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume


def box(size, offset=0.0):
    """A box 1 x 2 x 3 times `size`, right-handed."""
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 4)] * 3, indexing="ij"), axis=-1)
    return BSplineVolume.uniform(size * grid * [1.0, 2.0, 3.0] + offset)


def test_the_enclosed_volume_by_hand():
    assert enclosed_volume(box(2.0), np.array([1.0, 2.0, 3.0])) == pytest.approx(48.0)
    assert enclosed_volume(mirrored(box(2.0)), np.zeros(3)) == pytest.approx(-48.0)


@pytest.mark.parametrize("size", [1e-120, 1e-9, 1.0, 1e93])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_size_and_place_do_not_change_the_orientation(size, offset):
    volume = box(size, offset * size)
    assert orientation(volume) == 1 and orientation(mirrored(volume)) == -1


def test_reversals_and_exchanges_of_directions_change_it():
    volume = benchmark_volume(3)
    net = volume.control_points
    for axis in range(3):
        assert orientation(BSplineVolume.uniform(np.flip(net, axis))) == -1
        assert orientation(BSplineVolume.uniform(np.flip(net, (axis, axis - 1)))) == 1
    assert orientation(BSplineVolume.uniform(net.swapaxes(0, 1))) == -1
    assert orientation(BSplineVolume.uniform(net.transpose(1, 2, 0, 3))) == 1


def test_a_fold_leaves_it_to_the_larger_part():
    folded = benchmark_volume(4, amplitude=0.4)
    assert orientation(folded) == 1 and orientation(mirrored(folded)) == -1


def test_a_mirror_image_has_the_negative_determinant_exactly():
    volume, points = benchmark_volume(3), np.random.default_rng(0).random((50, 3))
    assert np.array_equal(mirrored(volume).jacobian(points)[:, 0], -volume.jacobian(points)[:, 0])
    assert check_boundary(mirrored(volume)).injective
