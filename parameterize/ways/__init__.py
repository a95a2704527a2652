"""Holds the ways to a map, one a file; strategy.py has their order."""
