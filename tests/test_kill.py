"""Runs killed by SIGKILL and resumed: one in every test run, thirty in the slow one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import iga_nn

PLACES = os.pathsep.join(str(Path(iga_nn.__file__).parents[1] / place) for place in (".", "tests/support"))
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def killing(moments):
    command = [sys.executable, str(Path(__file__).parent / "support" / "killing.py"), "--moments", str(moments)]
    environment = os.environ | {"PYTHONPATH": PLACES, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    print(done.stdout)  # noqa: T201 - the log is what the long test is run for
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{moments} of {moments} volumes are the same" in done.stdout


def test_killed_at_a_moment_and_resumed():
    killing(1)


@pytest.mark.slow
def test_killed_at_thirty_moments_and_resumed():
    killing(30)
