"""Array files: atomic writing and guarded reading of .npz, without pickles."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_UNPACKED_BYTES = 4 << 30


def save_arrays(path: str | Path, **arrays: NDArray[Any]) -> None:
    """Write a compressed .npz under a temporary name, then rename it: a reader never sees half a file.

    The bytes depend on the arrays alone, so equal results are equal files.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as stream:
            np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def save_text(path: str | Path, text: str) -> None:
    """Write a text file under a temporary name, then rename it."""
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def load_arrays(path: str | Path, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Read the named arrays of an .npz.

    Raises FileNotFoundError, or ValueError for anything that is not such a file: not an archive, a missing array,
    pickled content, or more than 4 GiB once unpacked.
    """
    source = Path(path)
    if not source.exists():
        raise FileNotFoundError(f"{source}: no such file")
    try:
        with zipfile.ZipFile(source) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > MAX_UNPACKED_BYTES:
            raise ValueError(f"{source}: unpacks to {unpacked} bytes, more than {MAX_UNPACKED_BYTES}")
        with np.load(source, allow_pickle=False) as data:
            missing = [name for name in names if name not in data.files]
            if missing:
                raise ValueError(f"{source}: has no array named {', '.join(missing)}")
            return {name: data[name] for name in names}
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(str(source)) else f"{source}: {text}") from None
    except (zipfile.BadZipFile, OSError, EOFError, KeyError, NotImplementedError, zipfile.error) as error:
        raise ValueError(f"{source}: not a readable .npz archive ({error})") from None
