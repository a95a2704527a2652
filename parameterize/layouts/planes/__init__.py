"""Divides a body that planes bound into hexahedra, glued by whole faces, which are exact."""
