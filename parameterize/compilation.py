"""Tells that kernels are compiled, where they are: on the first use on a machine; later they are loaded from disk."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from .kernel_cache import FOLDER, are_kept

log = logging.getLogger(__name__)

KEPT = ", on the first use alone; they are kept"
NOT_KEPT = f" in every run: neither the installation nor your cache can be written; let {FOLDER} name a folder"


class _Teller(event.Listener):  # type: ignore[misc]
    """Logs the first compilation of this process."""

    def __init__(self) -> None:
        self._has_told = False

    def on_start(self, event: Any) -> None:
        """Tell that a kernel is not in the cache."""
        if not self._has_told:
            self._has_told = True
            log.info("compiling kernels: some seconds%s", KEPT if are_kept() else NOT_KEPT)

    def on_end(self, event: Any) -> None:
        """Do nothing."""


_teller = _Teller()


@contextmanager
def compilation_told() -> Iterator[None]:
    """Log, once a process, that kernels are compiled, where the block has to compile one."""
    with event.install_listener("numba:compile", _teller):
        yield
