"""Solves the linear system by preconditioned Krylov methods."""
