"""Describes a boundary value problem: its equation, its data, and formulas for them."""
