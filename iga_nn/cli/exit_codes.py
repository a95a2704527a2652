"""Holds the exit codes of `iga-nn`; README explains them to users."""

DONE = 0
BAD_INPUT = 2
NOT_CERTIFIED = 3  # wins over NOT_SOLVED
NOT_SOLVED = 4
INTERRUPTED = 130
