"""What Ctrl-C and SIGTERM do while a kernel is compiled, and where they are ignored from the start."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
SUPPORT = TESTS / "support"

PROGRAM = """
import os, signal, time
import numba
from numba.core.codegen import CPUCodeLibrary
from iga_nn.__main__ import catch_signals

catch_signals()
compiled = CPUCodeLibrary._object_compiled_hook

def interrupted(*given):
    os.kill(os.getpid(), signal.{name})
    compiled(*given)

CPUCodeLibrary._object_compiled_hook = staticmethod(interrupted)
try:
    print(numba.njit(lambda x: x + 1)(1), flush=True)
    time.sleep(60.0)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_an_interruption_while_a_kernel_is_compiled_comes_right_after(name):
    """LLVM calls Python back when it is done; what is raised there is printed and forgotten."""
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(name=name)], capture_output=True, text=True, timeout=50)
    assert (done.stderr, done.stdout.split()[-1]) == ("", "interrupted")


IGNORING = "import os, signal, sys; signal.signal(signal.{name}, signal.SIG_IGN); os.execv(sys.executable, {command!r})"


def ignoring(name: str, program: str) -> str:
    """What a program prints that is started as `nohup .. &` of a script starts it: with that signal ignored."""
    code = IGNORING.format(name=name, command=[sys.executable, "-c", program])
    places = os.pathsep.join(str(place) for place in (TESTS.parent, TESTS, SUPPORT))
    environment = os.environ | {"PYTHONPATH": places}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=50)
    return done.stderr + done.stdout


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_what_the_tests_start_takes_signals_where_they_themselves_ignore_them(name):
    default = "signal.default_int_handler" if name == "SIGINT" else "signal.SIG_DFL"
    asked = f"import signal; print(signal.getsignal(signal.{name}) is {default})"
    program = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {asked!r}])"
    assert ignoring(name, program) == "False\n"
    assert ignoring(name, f"import conftest, os, signal; os.kill(os.getpid(), signal.{name}); {program}") == "True\n"


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_that_is_ignored_from_the_start_stays_so(name):
    interrupted = f"catch_signals(); os.kill(os.getpid(), signal.{name}); print('goes on')"
    assert ignoring(name, f"import os, signal; from iga_nn.__main__ import catch_signals; {interrupted}") == "goes on\n"
