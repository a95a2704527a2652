"""What the certificate sees of chosen spans, for comparison with other ways to compute it."""

import numpy as np

from parameterize.certificate.determinant import DeterminantForm


def coefficients_and_errors(volume, spans):
    """Bernstein coefficients of det J on spans (k, 3), and for every span a bound of the rounding error in them."""
    form = DeterminantForm(volume)
    values, permanents = form.coefficients(np.asarray(spans))
    return np.ldexp(np.moveaxis(values, -1, 0), form.exponent), np.ldexp(form.errors(permanents), form.exponent)


def bernstein_coefficients(volume, spans):
    """(k, d_u, d_v, d_w) with d = 3 * degree a direction."""
    return coefficients_and_errors(volume, spans)[0]
