"""Numbers the spans of a tensor-product spline: neighbours, the control points that act on spans, the cube's edges."""

import numpy as np
from scipy.ndimage import binary_dilation

from ..arrays import IntArray, Mask


def with_neighbours(spans: IntArray, n_spans: tuple[int, ...]) -> Mask:
    """Return the mask (n_u, n_v, n_w) of the spans (k, 3) and of all spans that touch these."""
    marked = np.zeros(n_spans, dtype=bool)
    marked[tuple(spans.T)] = True
    return np.asarray(binary_dilation(marked, np.ones((3, 3, 3), dtype=bool)))


def acting_on(spans: Mask, degree: int) -> Mask:
    """Return the mask (n_u, n_v, n_w) of the control points that act on marked spans.

    The mask of the spans has `degree` fewer entries in each direction.
    """
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(spans, degree), (degree + 1,) * 3)
    return np.asarray(windows.any(axis=(3, 4, 5)))


def edge_spans(n_spans: tuple[int, ...]) -> IntArray:
    """Return the spans (k, 3) that touch one of the cube's 12 edges."""
    index = np.indices(n_spans).reshape(3, -1).T
    at_side = (index == 0) | (index == np.array(n_spans) - 1)
    return index[at_side.sum(axis=1) >= 2]
