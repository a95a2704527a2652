"""Runs the console script and `python -m iga_nn`; the command line is imported where Ctrl-C is caught already."""

import signal
import sys
from types import FrameType


def run_and_exit() -> None:
    """Run the command line on the program's arguments."""
    try:
        signal.signal(signal.SIGTERM, _interrupt)  # which clusters and `timeout` send
        from .cli.commands import main

        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.stderr.write("iga-nn: interrupted; nothing was computed yet that could be resumed\n")
        code = 130
    sys.exit(code)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    run_and_exit()
