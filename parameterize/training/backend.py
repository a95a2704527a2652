"""Chooses the device, the precision and the threads of torch, which is loaded only where it is asked."""

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import CDLL
from pathlib import Path
from typing import Any, get_args

from ..config import Device

PRECISIONS = "float32", "float64"
_DRIVERS = "libcuda.so.1", "nvcuda.dll"  # of NVIDIA, on Linux and on Windows
_ROCM = Path("/dev/kfd")  # of AMD, which torch names cuda, too


def choose_device(name: str) -> str:
    """Return the device, "cpu" or "cuda", for "auto", "cpu" or "cuda". Raises ValueError where it is absent."""
    if name not in get_args(Device):
        raise ValueError(f"device {name!r}: choose auto, cpu or cuda")
    available = name != "cpu" and _has_device()
    if name == "cuda" and not available:
        raise ValueError("device cuda: torch finds no CUDA device here; use --device cpu")
    return "cuda" if available else "cpu"


def _has_device() -> bool:
    """Return whether torch finds a CUDA device; without a driver torch, which takes a second, is not loaded."""
    if not _ROCM.exists() and not any(_loads(driver) for driver in _DRIVERS):
        return False
    import torch

    return torch.cuda.is_available()


def _loads(library: str) -> bool:
    """Return whether a shared library is there."""
    try:
        CDLL(library)
    except OSError:
        return False
    return True


def choose_precision(dtype: Any) -> str:
    """Return "float32" or "float64" for one of these names, or for torch's object. Raises ValueError for others."""
    name = str(dtype).removeprefix("torch.")
    if name not in PRECISIONS:
        raise ValueError(f"dtype {name!r:.80}: choose float32 or float64")
    return name


@contextmanager
def one_thread_an_operation() -> Iterator[None]:
    """Let torch use one thread for each operation inside the context.

    Most tensors here are small: a second thread costs more time than it saves (up to 4 times). A thread of
    `in_parallel` takes torch's setting at its first operation and keeps it. All torch work in pieces needs this
    context: otherwise such a thread splits its sums, and the bits depend on which thread computes a piece.
    """
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
