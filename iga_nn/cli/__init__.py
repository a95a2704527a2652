"""Holds the command line: its commands, their progress, their answers and these exit codes."""

DONE = 0
BAD_INPUT = 2
NOT_CERTIFIED = 3  # wins over NOT_SOLVED
NOT_SOLVED = 4
NOT_THE_PART = 5  # wins over both
INTERRUPTED = 130
