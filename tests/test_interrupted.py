"""What Ctrl-C and SIGTERM do while a kernel is compiled."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os, signal, time
import numba
from numba.core.codegen import CPUCodeLibrary
from iga_nn.__main__ import catch_signals

signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored where the tests are started
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
