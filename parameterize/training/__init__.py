"""Trains the network that maps the solid inside a surface to the unit cube."""
