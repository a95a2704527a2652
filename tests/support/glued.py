"""What tests ask of a body that was written and read again."""

import numpy as np

from parameterize.spline.body import Body
from parameterize.spline.interface_rows import gaps

POINTS = np.random.default_rng(7).random((40, 3))


def demand_same(again, body):
    """The same patches in the same order, bit by bit, with the same interfaces; no gap in any."""
    assert isinstance(again, Body) and len(again) == len(body)
    for one, other in zip(again, body, strict=True):
        assert one.degrees == other.degrees
        assert np.array_equal(one.control_points, other.control_points)
        assert (one.weights is None) == (other.weights is None)
        assert one.weights is None or np.array_equal(one.weights, other.weights)
        assert all(np.array_equal(a, b) for a, b in zip(one.knots, other.knots, strict=True))
    assert set(again.interfaces) == set(body.interfaces)
    assert not gaps(again.groups, again.interface_rows).any()
