"""Lets a signal interrupt a run, later where an error would get lost."""

from types import FrameType

CALLED = (
    "llvmlite.",
    "weakref",
    "_weakrefset",
)  # begin the names of modules that are called back from outside of Python


def loses_errors(frame: FrameType | None) -> bool:
    """Return whether an error raised in a frame gets lost.

    This is so where LLVM has called Python while it compiles a kernel, and where an object is taken away.
    """
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith(CALLED) or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False
