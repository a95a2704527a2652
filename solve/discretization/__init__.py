"""Turns a problem on a spline volume into a linear system that is applied without a matrix."""
