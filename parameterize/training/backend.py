"""Chooses the device, the precision and the threads of torch."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch

PRECISIONS = {"float32": torch.float32, "float64": torch.float64}


def choose_device(name: str) -> str:
    """Return the device, "cpu" or "cuda", for "auto", "cpu" or "cuda". Raises ValueError where it is absent."""
    if name not in ("auto", "cpu", "cuda"):
        raise ValueError(f"device {name!r}: choose auto, cpu or cuda")
    available = torch.cuda.is_available()
    if name == "cuda" and not available:
        raise ValueError("device cuda: torch finds no CUDA device here; use --device cpu")
    return "cuda" if available and name != "cpu" else "cpu"


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
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
