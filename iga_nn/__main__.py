"""Runs the console script and `python -m iga_nn`; the command line is imported where Ctrl-C is caught already."""

import atexit
import gc
import os
import signal
import sys
from types import FrameType

from .signals import loses_errors

OBJECTS = 20_000  # new ones before Python looks for cycles: libraries make hundreds of thousands that stay
PAUSE = 0.1  # seconds after which an interruption is tried again


def run_and_exit() -> None:
    """Run the command line on the program's arguments."""
    atexit.register(_fall_silent)  # the first one to be registered is the last one to be called
    try:
        catch_signals()
        gc.set_threshold(OBJECTS)
        from .cli.commands import main

        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.stderr.write("iga-nn: interrupted; nothing was computed yet that could be resumed\n")
        code = 130
    gc.freeze()  # else Python looks through all objects for cycles before it ends, for half a second
    sys.exit(code)


def _fall_silent() -> None:
    """Drop what libraries print once Python ends: igl lists each of its objects that `gc.freeze` leaves in a cycle."""
    sys.stderr.flush()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def catch_signals() -> None:
    """Let Ctrl-C, and SIGTERM, which clusters and `timeout` send, raise KeyboardInterrupt.

    One that is ignored from the start stays so: `nohup`, or a script that starts the program in the background, wants
    it to go on.
    """
    if signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN:
        signal.signal(signal.SIGTERM, _interrupt)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Interrupt; later, where an error raised now would get lost."""
    if hasattr(signal, "setitimer") and loses_errors(frame):
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, PAUSE)
        return
    raise KeyboardInterrupt


if __name__ == "__main__":
    run_and_exit()
