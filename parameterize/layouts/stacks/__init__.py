"""Divides a stack of extrusions, whose outlines may be curved, into columns of blocks over a plane division."""
