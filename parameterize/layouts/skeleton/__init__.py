"""Finds the curve skeleton of a solid: the graph of its limbs and handles."""
