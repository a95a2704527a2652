"""Divides parts of the plane between outlines, straight or curved, into quadrangles with whole sides in common."""
