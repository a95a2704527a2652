"""Holds the starts, that is the ways to a first map, one a file."""
