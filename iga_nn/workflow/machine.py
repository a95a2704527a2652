"""The machine under a measurement: its speed, so that seconds compare between machines, and its name."""

from __future__ import annotations

import platform
import time
from pathlib import Path


def calibrate(share: float = 1.0, threads: int | None = None) -> tuple[float, int]:
    """t_cal, the wall seconds of 1e12 operations in float32 products (8192, 512) @ (512, 512), and the threads.

    share: of these operations that is measured, the rest is taken as equally fast; for quick looks.
    threads: default as many as torch would take.
    """
    import torch

    usual = torch.get_num_threads()
    torch.set_num_threads(threads or usual)
    left, right = torch.ones(8192, 512), torch.full((512, 512), 1.0 / 512.0)
    operations = 2 * 8192 * 512 * 512  # of one product
    repeats = max(1, round(share * 1e12 / operations))
    product = left @ right  # starts the threads
    start = time.perf_counter()
    for _ in range(repeats):
        torch.mm(left, right, out=product)
    seconds = time.perf_counter() - start
    torch.set_num_threads(usual)
    return seconds * 1e12 / (repeats * operations), threads or usual


def available_memory_mb() -> float | None:
    """Memory that a process can still take; None where the system does not say."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    found = (line.split() for line in lines if line.startswith("MemAvailable:"))
    return next((int(words[1]) / 1000.0 for words in found), None)


def processor() -> str:
    """The model of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())
