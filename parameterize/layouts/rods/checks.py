"""What is wrong with a start: pieces of blocks that are folded, and corners that lie outside of the body."""

import numpy as np

from ...arrays import Array, Mask

_TO_BERNSTEIN = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])  # from values at 0, 1/2, 1, degree 2
_LEAST = 0.02  # of the largest det J of a piece: a piece flatter than this counts as folded
_PLACES = np.array([0.0, 0.5, 1.0])


def folded(sections: Array) -> Mask:
    """Return which pieces between sections (m, 2, 2, 3) are not proved to have det J > 0: (m - 1,).

    det J of a trilinear piece is a polynomial of degree 2 in each direction; its Bernstein coefficients bound it.
    """
    corners = np.stack([sections[:-1], sections[1:]], axis=3)  # (m - 1, 2, 2, 2, 3), [u][v][w]
    even = np.stack([1.0 - _PLACES, _PLACES], axis=-1)  # (3, 2)
    ways = [
        np.einsum("nuvwx,bv,cw->nbcx", corners[:, 1:] - corners[:, :1], even, even)[:, None],
        np.einsum("nuvwx,au,cw->nacx", corners[:, :, 1:] - corners[:, :, :1], even, even)[:, :, None],
        np.einsum("nuvwx,au,bv->nabx", corners[..., 1:, :] - corners[..., :1, :], even, even)[:, :, :, None],
    ]
    columns = np.broadcast_arrays(*ways)  # (m - 1, 3, 3, 3, 3)
    values = np.einsum("...x,...x->...", np.cross(columns[0], columns[1]), columns[2])
    bounds = np.einsum("nabc,ia,jb,kc->nijk", values, *[_TO_BERNSTEIN] * 3)
    size = np.abs(values).max(axis=(1, 2, 3))
    return np.asarray(bounds.min(axis=(1, 2, 3)) <= _LEAST * size)
