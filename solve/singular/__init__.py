"""Finds the places of a problem where the gradient of the solution is infinite, from the body's edges and the data."""

from .find import singular_places
from .places import SPANS, SingularPlace, SingularPlaces

__all__ = ["SPANS", "SingularPlace", "SingularPlaces", "singular_places"]
