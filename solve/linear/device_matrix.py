"""Applies the matrix of a body to torch tensors, on a GPU or, for tests, on the CPU.

A CPU profits from the fact that few functions are nonzero at a point; a GPU profits from large matrix products: here
the bases of all directions are dense matrices, and many patches are multiplied at once. All numbers are in double
precision. Geometry factors come from the assembly on the CPU.
"""

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array
from torch import Tensor

from parameterize.arrays import IntArray
from parameterize.spline.bspline import collocation

from ..discretization.grouped import BodyMatrix, StackMatrix, law_of
from ..discretization.groups import OnPatches
from ..discretization.operator import FormOperator

PIECE_BYTES = 2**28  # of one field at the points of a piece

Fields = tuple[Any, Any, Any, Any]  # tensors (m, c, q_u, q_w, q_v): a value, None without a reaction, and a gradient


class DeviceMatrix:
    """Apply the matrix of a body with what it stores at the points as tensors on a device."""

    def __init__(self, matrix: BodyMatrix, device: str) -> None:
        alone = [_alone(matrix, patch) for patch in matrix.alone]
        self._pieces = [(one.group, piece) for one in (*matrix.stacks, *alone) for piece in _pieces(one, device)]
        faces = matrix.matrix_of(matrix.faces)
        self._faces = sparse(faces, device) if faces.nnz else None

    def apply(self, source: OnPatches) -> OnPatches:
        """Return the products with all coefficients of each patch, parts of a tensor, fixed ones included."""
        result = replace(source, flat=0.0 * source.flat)
        groups = list(zip(source.in_groups, result.in_groups, strict=True))
        for group, piece in self._pieces:
            piece.add_product(*groups[group])
        return result if self._faces is None else replace(result, flat=result.flat + self._faces @ source.flat)


@dataclass(frozen=True, eq=False)
class Piece:
    """Apply the matrices of m patches with equal bases at some points of u.

    places: (m,), the place of each patch in its group. functions: those of u that are not zero at the points. bases:
    of each direction the values and the derivatives (q, n) of its functions. has_value: whether the law has a reaction.
    flux: gives the fields that are integrated with each test function and its derivatives.
    """

    places: Tensor
    functions: slice
    bases: tuple[Tensor, Tensor, Tensor]
    has_value: bool
    flux: Callable[[Fields], Fields]

    def add_product(self, coefficients: Any, result: Any) -> None:
        """Add the products with coefficients (patches, c, n_u, n_v, n_w) of the group to a result of that shape."""
        found = self._integrals(self.flux(self._fields(coefficients[self.places, :, self.functions])))
        result[:, :, self.functions].index_add_(0, self.places, found)

    def _fields(self, x: Tensor) -> Fields:
        """Return the splines of coefficients (m, c, n_u, n_v, n_w) and their derivatives."""
        u, (b_v, d_v), (b_w, d_w) = self.bases
        planes, planes_u = (_along_u(matrix, x) for matrix in u)  # (m, c, q_u, n_v, n_w)
        lines = (b_v @ planes).mT
        value = b_w @ lines if self.has_value else None
        return value, b_w @ (b_v @ planes_u).mT, b_w @ (d_v @ planes).mT, d_w @ lines

    def _integrals(self, fields: Fields) -> Tensor:
        """Return the sums (m, c, n_u, n_v, n_w) over the points of fields times functions and their derivatives."""
        u, (b_v, d_v), (b_w, d_w) = self.bases
        value, along_u, along_v, along_w = fields
        lines = d_w.T @ along_w  # (m, c, q_u, n_w, q_v)
        if value is not None:
            lines += b_w.T @ value
        planes = (lines @ b_v + b_w.T @ along_v @ d_v).mT
        return _along_u(u[0].T, planes) + _along_u(u[1].T, (b_w.T @ along_u @ b_v).mT)


def on_device(array: NDArray[Any], device: str) -> Any:
    """Return an array as a tensor on a device, which serves code that is written for arrays."""
    return torch.as_tensor(np.ascontiguousarray(array), device=device)


def sparse(matrix: csr_array, device: str) -> Tensor:
    """Return a sparse matrix as a tensor on a device."""
    rows, columns, values = (torch.as_tensor(part) for part in (matrix.indptr, matrix.indices, matrix.data))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sparse CSR tensor support is in beta")
        return torch.sparse_csr_tensor(rows, columns, values, matrix.shape, device=device, check_invariants=False)


def _along_u(matrix: Tensor, x: Tensor) -> Tensor:
    """Return a matrix (k, n) applied along the third dimension of x (m, c, n, ..)."""
    return (matrix @ x.reshape(*x.shape[:3], -1)).reshape(*x.shape[:2], len(matrix), *x.shape[3:])


def _alone(matrix: BodyMatrix, patch: int) -> StackMatrix:
    """Return the matrix of a patch that is in no stack as that of a stack of one."""
    part, form = matrix.parts[patch], matrix.laws[patch].form
    group = next(number for number, own in enumerate(matrix.layout.groups) if patch in own)
    place = np.array([matrix.layout.groups[group].index(patch)])
    if isinstance(part, FormOperator):
        rows = None if part.rows is None else part.rows[None]
        return StackMatrix(part.stack, group, place, [form], rows, law_of(form)[None])
    return StackMatrix(part.stack, group, place, [form], part.factors[None], None)


def _pieces(matrix: StackMatrix, device: str) -> Iterator[Piece]:
    """Yield the pieces of a stack: its patches of one kind, as many at once as memory allows, at all points of u or,
    if a patch is large, at some.

    Raises ValueError for a law that is called at the points.
    """
    if matrix.factors is None:
        name = type(matrix.forms[0]).__name__
        raise ValueError(f"{name} is solved on device='cpu' only, got device={device!r}: its flux is not constant")
    stack, degree = matrix.stack, matrix.stack.space.degrees[0]
    plane = 8 * matrix.forms[0].components * math.prod(stack.plane_shape)
    at_once, points = max(1, PIECE_BYTES // (plane * stack.shape[0])), max(1, PIECE_BYTES // plane)
    for kind in np.unique(stack.kinds):
        patches, first = np.flatnonzero(stack.kinds == kind), stack.tables[0][0][kind]
        u, v, w = _bases(matrix, patches[0], device)
        for start in range(0, len(patches), at_once):
            own = patches[start : start + at_once]
            for q in range(0, stack.shape[0], points):
                here = slice(q, min(q + points, stack.shape[0]))
                functions = slice(int(first[q]), int(first[here.stop - 1]) + degree + 1)
                places, bases = on_device(matrix.places[own], device), (u[:, here, functions], v, w)
                yield Piece(places, functions, bases, *_law(matrix, own, here, device))


def _bases(matrix: StackMatrix, patch: int, device: str) -> tuple[Tensor, Tensor, Tensor]:
    """Return the values and the derivatives (2, q, n) of the functions of each direction at the points of a patch."""
    space, rule = matrix.stack.spaces[patch], matrix.stack.rules[patch]
    rows = zip(space.knots, space.degrees, rule.points, strict=True)
    u, v, w = (
        on_device(np.stack([collocation(knots, degree, points, d).toarray() for d in (0, 1)]), device)
        for knots, degree, points in rows
    )
    return u, v, w


def _law(matrix: StackMatrix, patches: IntArray, points: slice, device: str) -> tuple[bool, Callable[[Fields], Fields]]:
    """Return whether the law of some patches has a reaction, and their flux at some points of u."""
    assert matrix.factors is not None
    stored = on_device(matrix.factors[patches, points], device)
    if matrix.laws is None:
        return stored.shape[2] > 6, lambda fields: _scalar_flux(stored, fields)
    laws = on_device(matrix.laws[patches], device)
    return False, lambda fields: _constant_flux(stored, laws, fields)


def _scalar_flux(factors: Tensor, fields: Fields) -> Fields:
    """Return the flux of a scalar law with factors (m, q_u, 6 or 7, q_w, q_v)."""
    value, u, v, w = fields
    uu, uv, uw, vv, vw, ww, *mass = factors[:, None].unbind(3)
    reaction = None if value is None else mass[0] * value
    return reaction, uu * u + uv * v + uw * w, uv * u + vv * v + vw * w, uw * u + vw * v + ww * w


def _constant_flux(rows: Tensor, laws: Tensor, fields: Fields) -> Fields:
    """Return the flux of constant laws (m, c, 3, c, 3) with rows (m, q_u, 3, 3, q_w, q_v) of the geometry."""
    m, c, *points = fields[1].shape
    turn = [part.unbind(3) for part in rows[:, None].unbind(3)]  # [a][i]: (m, 1, q_u, q_w, q_v)
    gradient = [sum(turn[a][i] * fields[1 + a] for a in range(3)) for i in range(3)]
    flat = torch.stack(gradient, 2).reshape(m, 3 * c, -1)
    flux = (laws.reshape(m, 3 * c, 3 * c) @ flat).reshape(m, c, 3, *points).unbind(2)
    u, v, w = (sum(turn[a][i] * flux[i] for i in range(3)) for a in range(3))
    return None, u, v, w
