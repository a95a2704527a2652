"""Isogeometric solver on a B-spline volume."""
