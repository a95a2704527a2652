"""Reads surface files of every supported format into vertices and triangles."""
