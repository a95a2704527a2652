"""Finds a folder for compiled kernels where numba has none: in a read-only installation without a home."""

import atexit
import os
import shutil
import tempfile
from pathlib import Path

FOLDER = "NUMBA_CACHE_DIR"  # numba keeps kernels there; without it beside the modules, else in the user's cache
PREFIX = "iga-nn-kernels-"


def provide_folder() -> None:
    """Let numba keep kernels in a temporary folder, removed at the end, where it can write to no other one.

    Processes that this one starts find the same folder. Without it numba raises where a kernel is defined.
    """
    given = os.environ.get(FOLDER)
    if (given and _can_write(Path(given))) or _can_write(Path(__file__).with_name("__pycache__")):
        return
    from numba import config
    from numba.misc.appdirs import AppDirs

    if _can_write(Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)):
        return
    folder = tempfile.mkdtemp(prefix=PREFIX)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ[FOLDER] = config.CACHE_DIR = folder


def are_kept() -> bool:
    """Return whether kernels that are compiled now are there in the next run."""
    return not Path(os.environ.get(FOLDER, "")).name.startswith(PREFIX)


def _can_write(folder: Path) -> bool:
    """Return whether files can be made in a folder, which is made where it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
