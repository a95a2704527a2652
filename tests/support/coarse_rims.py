"""Conditions on regions that are integrated coarsely."""

from solve.discretization import surface_rule


def coarse_rims(patch):
    """Let points on the cut cells at a region's rim be few: they are most of what a small solve on regions costs.

    patch: sets an attribute of a module, as `setattr` or a monkeypatch's does.
    """
    patch(surface_rule, "FEWEST", 20)
    patch(surface_rule, "TOLERANCE", 1e-2)
