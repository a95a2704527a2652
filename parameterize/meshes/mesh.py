"""Defines VolumeMesh: points, and elements of several kinds with their numbers in a file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray
from .kinds import ElementKind, kind_named

MOST_SIZE = 1e100  # of a coordinate: products of six of them, and determinants, stay within double precision
LEAST_SIZE = 1e-40  # of the box of all points, for the same reason


@dataclass(frozen=True, eq=False)
class Block:
    """Elements of one kind.

    Attributes
    ----------
    kind : ElementKind
        Of all of them.
    nodes : (n, nodes) array of int
        The rows of their nodes in the points, in VTK's order.
    numbers : (n,) array of int
        Their numbers in the file, for messages.
    """

    kind: ElementKind
    nodes: IntArray
    numbers: IntArray


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """Hexahedra and tetrahedra of any degree, as a file holds them.

    Attributes
    ----------
    points : (n, 3) array
        In the user's units.
    blocks : tuple of Block
        The elements, by kind.
    unchecked : mapping of str to int
        How many solid elements of other kinds there are, such as wedges: nothing is proved of them.
    groups : mapping of str to array of int
        Rows of elements, counted through all blocks, by the name of their group.

    Raises
    ------
    ValueError
        For a mesh without elements, a node that does not exist, coordinates that are not finite, or are too large.

    Examples
    --------
    >>> import iga_nn
    >>> mesh = iga_nn.VolumeMesh.of([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], {"tetra": [[0, 1, 2, 3]]})
    >>> iga_nn.certify_mesh(mesh).verdict
    'certified'
    """

    points: Array
    blocks: tuple[Block, ...]
    unchecked: Mapping[str, int] = field(default_factory=dict)
    groups: Mapping[str, IntArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=np.float64)
        object.__setattr__(self, "points", points + 0.0)  # no -0.0: equal coordinates have equal bits
        blocks = tuple(block for block in self.blocks if len(block.nodes))
        object.__setattr__(self, "blocks", blocks)
        if not blocks:
            kinds = ", ".join(f"{count} {kind}" for kind, count in self.unchecked.items())
            raise ValueError(f"holds no hexahedra or tetrahedra{f', but {kinds}' if kinds else ''}")
        used = np.unique(np.concatenate([block.nodes.ravel() for block in blocks]))
        if used[0] < 0 or used[-1] >= len(points):
            raise ValueError("an element has a node that the file does not hold: export it again")
        if not np.isfinite(points[used]).all():
            raise ValueError("a coordinate is not finite: export it again")
        if np.abs(points[used]).max() > MOST_SIZE:
            raise ValueError(f"a coordinate exceeds {MOST_SIZE:g} in magnitude: choose another unit")
        if 0.0 < np.ptp(points[used], axis=0).max() < LEAST_SIZE:
            raise ValueError(f"the mesh is smaller than {LEAST_SIZE:g}: choose another unit")

    @classmethod
    def of(cls, points: ArrayLike, cells: Mapping[str, ArrayLike]) -> "VolumeMesh":
        """Return the mesh of points (n, 3) and of rows of nodes in VTK's order, by meshio's names of their kinds.

        Elements are numbered from 1 on. Raises ValueError for another kind, for rows of another length, and as the
        class does.
        """
        blocks, count = [], 0
        for name, rows in cells.items():
            kind = kind_named(name)
            nodes = np.atleast_2d(np.asarray(rows, dtype=np.int64))
            if nodes.shape[1] != len(kind.lattice):
                raise ValueError(f"{name}: expected rows of {len(kind.lattice)} nodes, got shape {nodes.shape}")
            blocks.append(Block(kind, nodes, count + 1 + np.arange(len(nodes))))
            count += len(nodes)
        return cls(np.asarray(points, dtype=np.float64), tuple(blocks))

    def __len__(self) -> int:
        return sum(len(block.nodes) for block in self.blocks)

    @property
    def starts(self) -> IntArray:
        """Return the row of each block's first element, counted through all blocks."""
        return np.cumsum([0, *(len(block.nodes) for block in self.blocks)])[:-1]

    @property
    def numbers(self) -> IntArray:
        """Return the numbers of all elements in the file, block after block."""
        return np.concatenate([block.numbers for block in self.blocks])

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of elements of each kind."""
        return {str(block.kind): len(block.nodes) for block in self.blocks}
