"""Lets a signal interrupt a run, later where an error would get lost."""

from types import FrameType


def is_compiling(frame: FrameType | None) -> bool:
    """Return whether LLVM has called Python while it compiles a kernel: an error raised there gets lost."""
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith("llvmlite."):
            return True
        frame = frame.f_back
    return False
