"""Every file of the corpus through `iga-nn check`: the exit code, one line for an error, no traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from corpus import CASES, large

import iga_nn
from iga_nn.cli.commands import main

MEMORY = 2 << 30  # bytes resident
SECONDS = 20  # the processor's


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
    code = main(["check", str(path), *CASES[name].options])
    captured = capsys.readouterr()
    holds(CASES[name], code, captured.out, captured.err)


def in_a_process_of_its_own(case, path):
    """What `pytest -s` prints of it is a row of the table: name, exit code, seconds, memory, first words."""
    path.write_bytes(case.content)
    command = [sys.executable, "-m", "iga_nn", "check", str(path), *case.options]
    environment = os.environ | {"PYTHONPATH": str(Path(iga_nn.__file__).parents[1])}
    out, error = path.with_suffix(".out"), path.with_suffix(".error")
    with out.open("wb") as first, error.open("wb") as second:
        process = subprocess.Popen(command, stdout=first, stderr=second, env=environment)
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    seconds, memory = used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss
    said = error.read_text().removeprefix(f"iga-nn: {path}: ") or case.says or "accepted"
    row = f"{path.name:20s} {process.returncode} {seconds:5.1f} s {memory / 1e6:5.0f} MB  {said.strip()[:70]}"
    print(row)  # noqa: T201
    holds(case, process.returncode, out.read_text(), error.read_text())
    assert memory < MEMORY and seconds < SECONDS


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="resource usage of POSIX")
@pytest.mark.parametrize("name", CASES)
def test_in_a_process_of_its_own(name, tmp_path):
    in_a_process_of_its_own(CASES[name], tmp_path / name)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="resource usage of POSIX")
def test_fifty_thousand_vertices_in_a_process_of_their_own(tmp_path):
    in_a_process_of_its_own(large(), tmp_path / "large.obj")
