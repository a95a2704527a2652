"""Carries a run from the surface to the finished output folder."""
