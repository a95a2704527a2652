"""Removes from the environment what no run loads; `make setup` runs it. pip uninstalls what is left as usual."""

import os
import shutil
import struct
import subprocess
import sysconfig
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

LEFT_OUT = (
    "torch/test",  # programs that test torch
    "torch/bin/test_*",
    "torch/bin/protoc*",  # and one that generates code
    "torch/include",  # headers, as below: compilers need them, Python does not
    "include/Eigen",
    "include/Spectra",
    "include/embree4",
    "include/netgen",
    "lib64/*.a",  # static libraries
    "share/doc",
    "vtkmodules/*.pyi",  # for editors
    "skimage/data/*.*[!y]",  # pictures to play with, all but the code
)
TESTED = ("matplotlib", "networkx", "numba", "numpy", "scipy", "skimage", "sympy")  # packages with tests inside
SOURCES = (".h", ".hpp", ".c", ".cpp", ".cu", ".pyx", ".pxd")  # for compilers
PROGRAM = shutil.which("strip")
LARGE = 500_000  # bytes of a library that is worth being stripped of the names of its inner functions


def left_out(site: Path) -> Iterator[Path]:
    """Yield the files and folders of a folder of packages that are not needed."""
    for pattern in LEFT_OUT:
        yield from site.glob(pattern)
    for package in TESTED:
        yield from (site / package).rglob("tests")
    yield from (path for path in site.rglob("*") if path.suffix in SOURCES)


def trim(site: Path) -> None:
    """Remove them, and strip the large libraries if the system has the program for it."""
    for path in list(left_out(site)):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    if PROGRAM:
        libraries = (path for path in site.rglob("*.so*") if path.is_file() and path.stat().st_size > LARGE)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(strip, libraries))


def strip(library: Path) -> None:
    """Replace a library by itself without symbols that no linker needs; one that would not load then is kept."""
    new = library.with_name(library.name + ".new")
    done = subprocess.run([PROGRAM, "--strip-unneeded", "-o", new, library], capture_output=True)
    if done.returncode == 0 and is_loadable(new):
        new.replace(library)  # not written over: another process may have it loaded
    else:
        new.unlink(missing_ok=True)


def is_loadable(library: Path) -> bool:
    """Tell if the segments of a 64-bit ELF file are aligned, which strip spoils where a wheel's tool had moved them."""
    with library.open("rb") as file:
        start = file.read(64)
        if start[:6] != b"\x7fELF\x02\x01":
            return False
        (place,), (size, count) = struct.unpack_from("<Q", start, 32), struct.unpack_from("<HH", start, 54)
        file.seek(place)
        segments = file.read(size * count)
    for at in range(0, size * count, size):
        kind, _, offset, address, _, _, _, alignment = struct.unpack_from("<IIQQQQQQ", segments, at)
        if kind == 1 and (address - offset) % alignment:
            return False
    return True


if __name__ == "__main__":
    trim(Path(sysconfig.get_path("purelib")))
