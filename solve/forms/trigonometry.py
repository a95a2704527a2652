"""Computes sine and cosine together, in one compiled pass of vector instructions: formulas need both, for derivatives.

The argument is reduced by multiples of pi / 2 in three steps (Cody and Waite, *Software Manual for the Elementary
Functions*, 1980), and the polynomials are those of fdlibm (Sun Microsystems, 1993). Results differ from the C library's
by two units in the last place at most.
"""

import numpy as np
from numba import njit

from parameterize.arrays import Array

LARGEST = 2.0**19  # of arguments; products of more quarter turns and the first two parts of pi / 2 would round
QUARTER = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)  # pi / 2 in three parts
SINE = (
    1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06, -1.98412698298579493134e-04,
    8.33333333332248946124e-03, -1.66666666666666324348e-01,
)  # fmt: skip
COSINE = (
    -1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07, 2.48015872894767294178e-05,
    -1.38888888888741095749e-03, 4.16666666666666019037e-02,
)  # fmt: skip


def sine_and_cosine(v: float | Array) -> tuple[float | Array, float | Array]:
    """Return sine and cosine of a number or of an array of any shape."""
    if np.size(v) < 2 or not (np.min(v) >= -LARGEST and np.max(v) <= LARGEST):  # NaN included
        return np.sin(v), np.cos(v)
    angles = np.ascontiguousarray(v)
    sine, cosine = np.empty(angles.shape), np.empty(angles.shape)
    _fill(angles.ravel(), sine.reshape(-1), cosine.reshape(-1))
    return sine, cosine


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})  # type: ignore[untyped-decorator]
def _fill(angles: Array, sine: Array, cosine: Array) -> None:
    """Write sine and cosine (n,) of angles (n,)."""
    for i in range(angles.size):
        turns = np.rint(angles[i] * (2.0 / np.pi))
        r = angles[i] - turns * QUARTER[0] - turns * QUARTER[1] - turns * QUARTER[2]
        z = r * r
        s = c = 0.0
        for factor in SINE:
            s = s * z + factor
        for factor in COSINE:
            c = c * z + factor
        half = 0.5 * z
        near = 1.0 - half
        s, c = r + r * z * s, near + (((1.0 - near) - half) + z * z * c)
        place = turns - 4.0 * np.floor(0.25 * turns)  # which of the four quarters: 0, 1, 2 or 3
        is_odd = (place == 1.0) | (place == 3.0)
        first, second = (c, s) if is_odd else (s, c)
        sine[i] = -first if place >= 2.0 else first
        cosine[i] = -second if (place == 1.0) | (place == 2.0) else second
