"""Layouts of bodies: blocks along a skeleton, on faces, between planes, over outlines."""
