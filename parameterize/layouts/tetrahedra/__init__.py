"""Hexahedra of tetrahedra: a coarse mesh that keeps a part's edges and faces, curved onto it, four hexahedra each."""
