"""Draws figures of maps and solutions. All values are samples of the spline itself; VTK only draws them.

Each function `draw_...` takes the file to write first, None for none, and returns the figure.
"""
