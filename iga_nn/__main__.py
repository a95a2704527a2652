"""`python -m iga_nn`: the command line."""

from .cli import run_and_exit

run_and_exit()
