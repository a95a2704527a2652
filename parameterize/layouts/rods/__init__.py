"""Blocks along a skeleton: bodies with handles and limbs as rods and junctions that are glued by whole faces."""
