"""The decorator of compiled kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(function: Kernel) -> Kernel:
    """Compile on first use, keep the machine code on disk, and let other threads run meanwhile."""
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    kernel: Kernel = njit(fastmath={"contract", "reassoc", "nsz"}, **options)(function)
    return kernel
