"""Runs killed by SIGKILL and resumed: a few in every test run, at thirty moments and all stages in the slow one."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import iga_nn

PLACES = os.pathsep.join(str(Path(iga_nn.__file__).parents[1] / place) for place in (".", "tests/support", "tests"))
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def killed(program, *options):
    command = [sys.executable, str(Path(__file__).parent / "support" / program), *options]
    environment = os.environ | {"PYTHONPATH": PLACES, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    print(done.stdout)  # noqa: T201 - the log is what the long test is run for
    assert done.returncode == 0, done.stdout + done.stderr
    (last,) = re.findall(r"(\d+) of (\d+) volumes are the same", done.stdout)
    assert last[0] == last[1] != "0"


def test_killed_at_a_moment_and_resumed():
    killed("killing.py", "--moments", "1")


@pytest.mark.slow
def test_killed_at_thirty_moments_and_resumed():
    killed("killing.py", "--moments", "30")


@pytest.mark.slow
def test_killed_once_blocks_are_laid_and_resumed():
    killed("killing_stages.py", "--bodies", "L", "shaft")


@pytest.mark.slow
def test_killed_after_each_stage_and_resumed():
    killed("killing_stages.py")


@pytest.mark.slow
def test_a_whole_run_killed_in_each_stage_and_resumed():
    killed("killing_run.py")
