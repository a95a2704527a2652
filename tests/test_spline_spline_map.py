import numpy as np
import pytest
from block_bodies import ring, sampled, wavy

from parameterize.spline.bspline import greville, halved, open_uniform_knots
from parameterize.spline.spline_map import SplineMap
from parameterize.spline.volume import BSplineVolume


def test_a_volume_comes_back_with_its_bits():
    knots = (open_uniform_knots(6, 3), open_uniform_knots(5, 3), open_uniform_knots(7, 3))
    volume = BSplineVolume((3, 3, 3), knots, np.random.default_rng(0).normal(size=(6, 5, 7, 3)))
    spline = SplineMap.of(volume)
    assert spline.nets.shapes == ((6, 5, 7),)
    assert spline.control.shape == (3, 6 * 5 * 7) and spline.control.flags.c_contiguous
    assert np.array_equal(spline.volume.control_points, volume.control_points)
    assert np.array_equal(spline.with_control(2.0 * spline.control).volume.control_points, 2.0 * volume.control_points)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_map_on_every_third_knot_is_carried_exactly(degree):
    """The fine knots contain the coarse ones: the fine space contains the map."""
    knots, finer = ((open_uniform_knots(degree + spans, degree),) * 3 for spans in (2, 6))
    spline = SplineMap.on_cube(degree, knots, np.random.default_rng(0).normal(size=(3, *[degree + 2] * 3)))
    places = [np.linspace(0.0, 1.0, 7)] * 3
    assert spline.interpolated(finer).volume.grid(*places) == pytest.approx(spline.volume.grid(*places), abs=1e-12)


def test_a_linear_map_is_carried_to_any_knots():
    knots, finer = ((open_uniform_knots(3 + spans, 3),) * 3 for spans in (3, 7))
    cube = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"))
    places = [np.linspace(0.0, 1.0, 5)] * 3
    values = SplineMap.on_cube(3, knots, cube).interpolated(finer).volume.grid(*places)
    assert values == pytest.approx(np.stack(np.meshgrid(*places, indexing="ij"), axis=-1), abs=1e-12)


def test_inserted_knots_leave_a_map_of_blocks_as_it_is_and_glued_bit_by_bit():
    spline = wavy(ring(turn=5, count=4), 0.02)
    finer = spline.on_knots(tuple((halved(u), halved(v), halved(w)) for u, v, w in spline.nets.knots))
    assert finer.nets.spans == ((6, 6, 6),) * 4 and len(finer.body.interfaces) == 4
    assert np.array_equal(finer.control, finer.nets.merged(finer.control))
    assert sampled(finer).points == pytest.approx(sampled(spline).points, abs=1e-12)
