"""Fits a spline to the trained map and moves its control points until it folds nowhere."""
