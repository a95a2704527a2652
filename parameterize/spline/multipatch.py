"""Holds the name that Body had: pickles of earlier versions look for it here."""

from .body import Body as MultiPatch

__all__ = ["MultiPatch"]
