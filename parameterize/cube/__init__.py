"""Lays a closed surface out on the six faces of the unit cube."""
