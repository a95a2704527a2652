"""Solves the linear system on torch tensors, on a GPU or, for tests, on the CPU: unknowns, preconditioner, iteration.

The preconditioners are those of the CPU with tensors in place of arrays: what their loops do is the same. The coarsest
grid of a multigrid is solved on the CPU by its sparse factor.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients

from ..discretization.grouped import BodyMatrix
from ..discretization.groups import OnPatches
from ..discretization.unknowns import Glued, Unknowns, Window
from .device_matrix import DeviceMatrix, on_device, sparse
from .low_order import LowOrder
from .multigrid import GridLevel, Multigrid
from .preconditioner import Componentwise, FastDiagonalization


def check_available(device: str) -> None:
    """Raise ValueError where torch has no such device on this machine."""
    if device.startswith("cuda") and not torch.cuda.is_available():
        raise ValueError(f"device {device!r}: torch finds no CUDA GPU here; use device='cpu'")


def solve_on_device(
    unknowns: Unknowns,
    matrix: BodyMatrix,
    inverse: Componentwise | LowOrder,
    right: Array,
    tolerance: float,
    max_iterations: int,
    device: str,
    start: Array | None = None,
) -> LinearResult:
    """Return the result of `conjugate_gradients` for the free unknowns (c, ...) of a body, computed on a torch device.

    Raises ValueError for a law whose flux is called at the points.
    """
    b, first = (None if x is None else on_device(x, device) for x in (right, start))
    there, product = DeviceUnknowns(unknowns, len(right), device), DeviceMatrix(matrix, device)
    found = conjugate_gradients(
        lambda x: there.collect(product.apply(there.spread(x))).reshape(x.shape),
        b,
        device_preconditioner(inverse, there, device),
        tolerance,
        max_iterations,
        first,
    )
    return replace(found, x=found.x.cpu().numpy())


class DeviceUnknowns:
    """Spread vectors to the coefficients of patches, and collect integrals, as `Glued` does, with tensors."""

    def __init__(self, unknowns: Unknowns, components: int, device: str) -> None:
        glued = Glued.of([unknowns.space], ()) if isinstance(unknowns, Window) else unknowns
        assert isinstance(glued, Glued)
        self.layout, self.processes, self._components = glued.layout, glued.processes, components
        (count,) = glued.shape
        component, place = np.divmod(self.layout.numbers(glued.places, components, count + 1), count + 1)
        entries = np.where(place < count, component * count + place, components * count)
        free = np.flatnonzero(place < count)
        ones = np.ones(len(free)), (entries[free], free)
        sums = csr_array(ones, shape=(components * count, len(entries)))
        self._entries, self._sums = on_device(entries, device), sparse(sums, device)
        self._firsts = on_device(sums.indices[sums.indptr[:-1]], device)

    def spread(self, x: Tensor) -> Any:
        """Return the coefficients of each patch of a vector (c, ...), parts of a tensor, zero where they are fixed."""
        return self._on_patches(torch.cat([x.reshape(-1), x.new_zeros(1)])[self._entries])

    def collect(self, integrals: OnPatches) -> Any:
        """Return the vector (c, m) of integrals over each patch, copies added in one order."""
        return (self._sums @ integrals.flat).reshape(self._components, -1)

    def chosen(self, coefficients: OnPatches) -> Any:
        """Return the vector (c, m) of the coefficients of a function that is continuous across interfaces."""
        return coefficients.flat[self._firsts].reshape(self._components, -1)

    def _on_patches(self, flat: Any) -> OnPatches:
        return OnPatches(self.layout, self._components, flat)


def device_preconditioner(inverse: Componentwise | LowOrder, unknowns: Any, device: str) -> Callable[[Tensor], Tensor]:
    """Return a preconditioner of vectors (c, ...) with tensors on a device."""
    if isinstance(inverse, LowOrder):
        return _low_order(inverse, unknowns, device)  # type: ignore[return-value]  # of arrays and tensors alike
    blocks = [_diagonalization(block, device) for block in inverse.blocks]
    return lambda residual: torch.stack([block(part) for block, part in zip(blocks, residual, strict=True)])


def _diagonalization(block: FastDiagonalization, device: str) -> Any:
    u, v, w, inverse, scaling = (on_device(part, device) for part in (*block.vectors, block.inverse, block.scaling))
    return _OnDevice(block.space, (u, v, w), inverse, scaling, block.singular)


class _OnDevice(FastDiagonalization):
    def _along_u(self, u: Any, x: Any, after: Any = None) -> Any:
        result = torch.tensordot(u, x, 1)
        return result if after is None else after * result

    def _across(self, v: Any, w: Any, x: Any, before: Any = None, after: Any = None) -> Any:
        result = (v @ (x if before is None else before * x)) @ w.T
        return result if after is None else after * result


def _low_order(inverse: LowOrder, unknowns: Any, device: str) -> LowOrder:
    factors = [tuple(on_device(part, device) for part in group) for group in inverse.basis.inverses]
    basis: Any = replace(
        inverse.basis, unknowns=unknowns, inverses=factors, copies=on_device(inverse.basis.copies, device)
    )
    cycle = inverse.cycle and _multigrid(inverse.cycle, device)
    return replace(inverse, basis=basis, cycle=cycle, local=on_device(inverse.local, device))


def _multigrid(cycle: Multigrid, device: str) -> Multigrid:
    levels = [_level(level, device) for level in cycle.levels]
    return Multigrid(levels, lambda x: on_device(cycle.coarsest(x.cpu().numpy()), device))  # type: ignore[attr-defined]


def _level(level: GridLevel, device: str) -> GridLevel:
    matrix: Any = sparse(level.matrix.tocsr(), device)
    coarser: Any = _Interpolation(level.coarser, device)
    return _DeviceLevel(level.unknowns, matrix, on_device(level.inverses, device), level.largest, coarser)


class _DeviceLevel(GridLevel):
    def product(self, x: Any) -> Any:
        return (self.matrix @ x.reshape(-1)).reshape(x.shape)

    def restricted(self, residual: Any) -> Any:
        return self.coarser.T @ residual

    def relaxed(self, residual: Any) -> Any:
        return (self.inverses @ residual[..., None])[..., 0]


class _Interpolation:
    """Multiply by a sparse matrix, and by its transpose `T`, both stored in rows."""

    def __init__(self, matrix: csr_array, device: str) -> None:
        self._rows, self.T = sparse(matrix, device), sparse(matrix.T.tocsr(), device)

    def __matmul__(self, x: Tensor) -> Tensor:
        return self._rows @ x
