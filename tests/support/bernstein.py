"""What the certificate sees of chosen spans, for comparison with other ways to compute it."""

import numpy as np

from parameterize.certificate.determinant import DeterminantForm
from parameterize.spline.patch_groups import group_of


def coefficients_and_errors(volume, spans):
    """Bernstein coefficients of det J on spans (k, 3), and for every span a bound of the rounding error in them."""
    form = DeterminantForm(group_of(volume))
    values, permanents = form.coefficients(np.insert(spans, 0, 0, axis=1))
    (exponent,) = form.exponents
    return np.ldexp(np.moveaxis(values, -1, 0), exponent), np.ldexp(form.errors(permanents), exponent)


def bernstein_coefficients(volume, spans):
    """(k, d_u, d_v, d_w) with d = 3 * degree a direction."""
    return coefficients_and_errors(volume, spans)[0]
