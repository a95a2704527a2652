"""Reads and writes spline volumes in the file formats of other programs."""
