"""Reads, checks and repairs the triangle mesh of a closed surface."""
