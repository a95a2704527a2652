"""Every file of the corpus through `iga-nn check`: the exit code, one line for an error, no traceback."""

import resource
import subprocess
import sys

import pytest
from corpus import CASES

from iga_nn.cli import main

MEMORY = 2 << 30  # bytes resident
SECONDS = 20


def holds(case, code, output, error):
    assert code == case.code, error
    if case.code:
        assert error.startswith("iga-nn: ") and len(error.splitlines()) == 1
        assert case.says in error and not output
    else:
        assert case.says in output and not error


@pytest.mark.parametrize("name", CASES)
def test_check_says_what_is_expected(name, tmp_path, capsys):
    path = tmp_path / name
    path.write_bytes(CASES[name].content)
    code = main(["check", str(path)])
    captured = capsys.readouterr()
    holds(CASES[name], code, captured.out, captured.err)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_in_a_process_of_its_own(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(CASES[name].content)
    command = [sys.executable, "-m", "iga_nn", "check", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    holds(CASES[name], done.returncode, done.stdout, done.stderr)
    assert 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < MEMORY  # the largest child so far
