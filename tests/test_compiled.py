"""What the machine code on disk depends on."""

import importlib
import pkgutil
import typing

import pytest
from numba.core.registry import CPUDispatcher

import parameterize
import solve

PROGRAM = "parameterize.surface.readers.opencascade"  # run in a process of its own, where the extra `cad` is there


@pytest.mark.parametrize("package", [solve, parameterize])
def test_kernels_take_nothing_that_is_defined_in_a_module(package):
    """The cache of a kernel is pickled with the types of its arguments: a class that moves makes it unreadable."""
    found = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    modules = [importlib.import_module(m.name) for m in found if m.name != PROGRAM]
    kernels = {kernel for module in modules for kernel in vars(module).values() if isinstance(kernel, CPUDispatcher)}
    assert len(kernels) > 5
    for kernel in kernels:
        for hint in typing.get_type_hints(kernel.py_func).values():
            assert not (isinstance(hint, type) and hint.__module__.startswith(("solve", "parameterize"))), kernel
