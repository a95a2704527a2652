"""Finds the places of a problem where the gradient of the solution is infinite, from the body's edges and the data."""

from .find import singular_places
from .places import SingularPlace, SingularPlaces

__all__ = ["SingularPlace", "SingularPlaces", "singular_places"]
