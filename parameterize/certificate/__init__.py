"""Proves that a spline volume folds nowhere and that its faces do not meet."""
