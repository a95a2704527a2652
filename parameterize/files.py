"""Files: atomic writing, guarded reading of .npz without pickles, unpacking of .gz within a limit."""

import gzip
import hashlib
import io
import math
import os
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

MAX_UNPACKED_BYTES = 512 << 20
PACKED = 1  # of 9: archives are 4 % larger than by NumPy's 6, in a quarter of the time


def digest(path: Path) -> str:
    """Return the SHA-256 of a file; "" where there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def save_arrays(path: str | Path, **arrays: NDArray[Any]) -> None:
    """Write a compressed .npz under a temporary name, then rename it: a reader never sees half a file.

    The bytes depend on the arrays alone, so equal results are equal files. Raises OSError naming the file.
    """
    pack: dict[str, Any] = {"compression": zipfile.ZIP_DEFLATED, "compresslevel": PACKED}
    with replacing(Path(path)) as temporary, zipfile.ZipFile(temporary, "w", **pack) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                npy.write_array(stream, np.asarray(array), allow_pickle=False)


def save_bytes(path: str | Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it. Raises OSError naming the file."""
    with replacing(Path(path)) as temporary:
        temporary.write_bytes(content)


def save_text(path: str | Path, text: str) -> None:
    """Write a text file as `save_bytes` does, in UTF-8; what is not Unicode, say in a file's name, is escaped."""
    save_bytes(path, text.encode(errors="backslashreplace"))


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Yield a temporary name beside `target`, of the same suffix, to write to; the file is renamed after the block.

    Raises OSError naming the target; where the block fails, the target stays as it was.
    """
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        error.filename = str(target)  # a full disk is reported without one
        raise
    finally:
        temporary.unlink(missing_ok=True)


def unfinished(target: Path) -> list[Path]:
    """Return the files left beside `target` by processes that were killed while they wrote it."""
    return list(target.parent.glob(f".{escape(target.stem)}.*.part{escape(target.suffix)}"))


def array_names(path: str | Path) -> list[str]:
    """Return the names of the arrays of an .npz. Raises FileNotFoundError, or ValueError for another file."""
    source = _existing(path)
    try:
        with zipfile.ZipFile(source) as archive:
            return [name.removesuffix(".npy") for name in archive.namelist()]
    except Exception as error:  # of a damaged archive
        raise _unreadable(source, error) from None


def load_arrays(path: str | Path, names: tuple[str, ...], extra: tuple[str, ...] = ()) -> dict[str, NDArray[Any]]:
    """Read the named arrays of an .npz, those of `extra` where it has them, and no others.

    Raises FileNotFoundError, or ValueError for anything that is not such a file: not an archive, a missing array,
    pickled content, a header that does not match the data behind it, or more than 512 MiB once unpacked.
    """
    source = _existing(path)
    try:
        with zipfile.ZipFile(source) as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy warns of headers by Python 2, also where they are only damaged
            held = {entry.filename.removesuffix(".npy"): entry for entry in archive.infolist()}
            missing = [name for name in names if name not in held]
            wanted = [name for name in (*names, *extra) if name in held]
            unpacked = sum(held[name].file_size for name in wanted)
            refused = missing or unpacked > MAX_UNPACKED_BYTES
            arrays = {} if refused else {name: _read_array(archive, held[name]) for name in wanted}
    except Exception as error:  # of a damaged archive: zipfile, its decompressors and numpy raise a dozen kinds
        raise _unreadable(source, error) from None
    if missing:
        arrays_held = sorted(name for name, entry in held.items() if entry.filename.endswith(".npy"))
        remedy = f"it holds {', '.join(arrays_held):.100}" if arrays_held else "unpack what is in it first"
        raise ValueError(f"{source}: has no array named {', '.join(missing)}; {remedy}")
    if refused:
        raise ValueError(f"{source}: unpacks to {unpacked} bytes, more than {MAX_UNPACKED_BYTES}")
    return arrays


def _existing(path: str | Path) -> Path:
    if not Path(path).exists():
        raise FileNotFoundError(f"{path}: no such file")
    return Path(path)


def _unreadable(source: Path, error: Exception) -> ValueError:
    return ValueError(f"{source}: not a readable .npz archive ({str(error) or type(error).__name__})")


def _read_array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    """Return one array, once its header agrees with its size: before that no memory is allocated."""
    with archive.open(entry) as stream:
        read_header = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        if not dtype.hasobject and math.prod(shape) * dtype.itemsize != entry.file_size - stream.tell():
            raise ValueError(f"{entry.filename} does not have the size its header says")
    with archive.open(entry) as stream:
        return np.asarray(npy.read_array(stream, allow_pickle=False))


def gunzip(packed: bytes, most: int) -> bytes:
    """Return what is packed by gzip, of which at most `most` + 1 bytes are unpacked. Raises ValueError for damage."""
    try:
        with gzip.open(io.BytesIO(packed)) as stream:
            return stream.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"not a whole .gz file ({error})") from None
