"""Compiling is told where a kernel is compiled, and not where it is loaded from the cache on disk."""

import importlib
import logging
import sys

import numpy as np
import pytest

import iga_nn
import solve.preparation
from parameterize import compilation, kernel_cache
from solve.study import benchmark_volume

KERNEL = """
import numba

@numba.njit(cache=True)
def doubled(x):
    return 2 * x
"""


@pytest.fixture
def told(monkeypatch, caplog):
    """What a new process tells: the lines so far."""
    caplog.set_level(logging.INFO)

    def lines():
        found = [record.getMessage() for record in caplog.records if "compil" in record.getMessage()]
        caplog.clear()
        monkeypatch.setattr(compilation, "_teller", compilation._Teller())
        return found

    lines()
    return lines


def loaded(folder, monkeypatch):
    """The kernel as a new process has it."""
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(folder / "cache"))
    sys.modules.pop("a_kernel", None)
    importlib.invalidate_caches()
    return importlib.import_module("a_kernel").doubled


def test_a_kernel_is_told_of_where_it_is_compiled_and_only_there(tmp_path, monkeypatch, told):
    (tmp_path / "a_kernel.py").write_text(KERNEL)
    for value, expected in ((1, 1), (2, 0), (np.float64(1.5), 1), (2.5, 0)):  # one machine code for each type
        kernel = loaded(tmp_path, monkeypatch)
        with compilation.compilation_told():
            assert kernel(value) == 2 * value
        assert len(told()) == expected, value


def test_several_kernels_are_told_of_once(tmp_path, monkeypatch, told):
    (tmp_path / "a_kernel.py").write_text(KERNEL)
    kernel = loaded(tmp_path, monkeypatch)
    for value in (1, 1.5, 1j):
        with compilation.compilation_told():
            kernel(value)
    assert told() == ["compiling kernels: some seconds, on the first use alone; they are kept"]


def test_kernels_in_a_temporary_folder_are_said_not_to_be_kept(tmp_path, monkeypatch, told):
    (tmp_path / "a_kernel.py").write_text(KERNEL)
    monkeypatch.setenv(kernel_cache.FOLDER, str(tmp_path / f"{kernel_cache.PREFIX}1"))
    kernel = loaded(tmp_path, monkeypatch)
    with compilation.compilation_told():
        kernel(1)
    assert "in every run: neither the installation nor your cache can be written" in told()[0]


def test_a_solve_with_kernels_on_disk_tells_nothing(told):
    volume, problem = benchmark_volume(2), iga_nn.Poisson(exact="x")
    iga_nn.solve(volume, problem)
    told()
    solve.preparation._warm_up.cache_clear()
    iga_nn.solve(volume, problem)
    assert told() == []
