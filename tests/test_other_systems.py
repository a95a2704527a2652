"""A run needs nothing that Windows and macOS lack; it is tried by taking that away from Python."""

import os
import subprocess
import sys

TAKE_AWAY = """
import multiprocessing, os, signal, sys
for module in ("fcntl", "grp", "pwd", "resource", "termios"):
    sys.modules[module] = None
for name in ("fork", "forkpty", "getuid", "getloadavg", "killpg", "sched_getaffinity", "sched_setaffinity"):
    delattr(os, name)
for name in ("SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "setitimer", "alarm", "pthread_sigmask"):
    delattr(signal, name)
multiprocessing.set_start_method("spawn", force=True)


def refuse(event, details):
    if event == "open" and str(details[0]).startswith("/proc/") and not str(details[0]).endswith("maps"):  # of packages
        raise FileNotFoundError(details[0])


sys.addaudithook(refuse)
from iga_nn.cli.commands import main

sys.exit(main(sys.argv[1:]))
"""


def run(*arguments, folder):
    environment = os.environ | {"PYTHONWARNINGS": "error::EncodingWarning", "PYTHONWARNDEFAULTENCODING": "1"}
    command = [sys.executable, "-P", "-c", TAKE_AWAY, *arguments]
    found = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8")
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_a_body_is_checked(tmp_path):
    run("sample", "bean", folder=tmp_path)
    assert run("check", "bean.obj", folder=tmp_path).startswith("accepted")


def test_a_run_ends_with_its_files(tmp_path):
    run("run", "poisson", "cube", "--refine", "0", "--time-limit", "10min", "--out", "out", folder=tmp_path)
    assert (tmp_path / "out" / "report.html").exists() and (tmp_path / "out" / "volume.npz").exists()
