"""A plugin of pytest that disturbs rounding, as another processor does: control points are moved by some 1e-15.

    PYTHONPATH=tests/support python -m pytest -p disturbed

The last three bits of every control point become 101, which moves it by up to 9e-16 of its size, always to the same
place: a volume that is saved and read again keeps its bits. Zeros stay. `make disturbed` runs the suite so, and with
plain kernels of NumPy, numba and OpenBLAS.
"""

import numpy as np

from parameterize.spline.volume import BSplineVolume

_accept = BSplineVolume.__post_init__
LAST, PATTERN = np.uint64(7), np.uint64(5)


def _moved(volume):
    _accept(volume)
    points = np.array(volume.control_points)
    bits = points.view(np.uint64)
    bits[points != 0.0] = (bits[points != 0.0] & ~LAST) | PATTERN
    object.__setattr__(volume, "control_points", points)


def pytest_configure():
    """Move the control points of every volume that is made from now on."""
    BSplineVolume.__post_init__ = _moved


def pytest_collection_modifyitems(items):
    """Leave out the tests of bodies that are degenerate, or plane, to the last bit."""
    items[:] = [item for item in items if "exact" not in item.keywords]
