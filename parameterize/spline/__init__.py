"""Evaluates and refines B-splines of one and of three parameters."""
