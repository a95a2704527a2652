"""Measures how much a spline volume distorts and how closely it follows its surface."""
