"""Refines a solve where it counts, until asked numbers are known as well as wanted: solve, estimate, mark, halve."""
