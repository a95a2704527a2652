"""Solves the linear system by preconditioned conjugate gradients."""
