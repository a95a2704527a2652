"""Removes from the environment what no run loads; `make setup` runs it. pip uninstalls what is left as usual."""

import shutil
import sysconfig
from collections.abc import Iterator
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
)
TESTED = ("matplotlib", "networkx", "numba", "numpy", "scipy", "skimage", "sympy")  # packages with tests inside


def left_out(site: Path) -> Iterator[Path]:
    """Yield the files and folders of a folder of packages that are not needed."""
    for pattern in LEFT_OUT:
        yield from site.glob(pattern)
    for package in TESTED:
        yield from (site / package).rglob("tests")


def trim(site: Path) -> None:
    """Remove them."""
    for path in list(left_out(site)):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()


if __name__ == "__main__":
    trim(Path(sysconfig.get_path("purelib")))
