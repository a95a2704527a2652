"""Runs the console script and `python -m iga_nn`; the command line is imported where Ctrl-C is caught already."""

import atexit
import gc
import os
import signal
import sys
from types import FrameType

from .signals import loses_errors

OBJECTS = 1_000_000  # new ones before Python looks for cycles: it finds those of libraries, which stay, none of ours
UNREAD = 120  # Python's code where what is printed cannot be written
PAUSE = 0.1  # seconds after which an interruption is tried again


def run_and_exit() -> None:
    """Run the command line on the program's arguments."""
    ended: list[int] = []
    atexit.register(_leave, ended)  # the first one to be registered is the last one to be called
    try:
        catch_signals()
        gc.set_threshold(OBJECTS)
        from .cli.commands import main

        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.stderr.write("iga-nn: interrupted; nothing was computed yet that could be resumed\n")
        code = 130
    ended.append(code)
    sys.exit(code)


def _leave(ended: list[int]) -> None:
    """End the process with the code `ended`; Python would take a quarter of a second to free what libraries hold."""
    if not ended or "mpi4py.MPI" in sys.modules:  # an error of ours; MPI has to hear that a process ends
        return
    code = ended[0]
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except (OSError, ValueError):  # nobody reads on, or it is closed
            code = UNREAD
    os._exit(code)


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
