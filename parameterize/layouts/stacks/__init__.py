"""Divides a stack of extrusions, whose outlines may be curved, into blocks over a plane decomposition."""
