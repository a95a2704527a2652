"""Volumes in the files of other programs: which formats there are, and their file names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from parameterize.files import replacing
from parameterize.volume import BSplineVolume

from . import spline_files
from .options import InputError

Format = Literal["mfem"]

_ENDINGS: dict[str, str] = {"mfem": ".mesh"}
_WRITERS: dict[str, Callable[[Path, BSplineVolume], None]] = {"mfem": spline_files.write_mfem}


def export(volume: BSplineVolume, to: Format, path: str | Path, *, force: bool = False) -> Path:
    """Write a volume in the format `to`; atomic.

    path: a file, or the folder or stem that the format's own ending is put to.
    Raises InputError where the file exists (unless `force`), cannot be written, or a package is missing.
    """
    target = Path(path)
    if not target.suffix:
        target = target.with_name(target.name + _ENDINGS[to])
    if target.is_dir():
        raise InputError(f"{target}: is a directory: name a file with --out")
    if target.exists() and not force:
        raise InputError(f"{target}: exists; --force replaces it, --out names another file")
    if not target.parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.parent}: make it, or choose another with --out")
    try:
        with replacing(target) as temporary:
            _WRITERS[to](temporary, volume)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}): choose another with --out") from None
    return target
