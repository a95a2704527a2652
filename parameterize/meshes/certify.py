"""Certifies a volume mesh: det J of one sign on every element, and elements that do not overlap."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..arrays import Array, IntArray, in_brackets, listed
from .evaluation import point_at
from .mesh import VolumeMesh
from .overlap import OverlapCheck, check_overlap
from .search import FLAT, FOLDED, INVERTED, POSITIVE, UNDECIDED, WORDS, ElementsCertificate, certify_elements

MeshVerdict = Literal["certified", "folded", "flat", "undecided"]
SHOWN = 10  # numbers of bad elements


@dataclass(frozen=True, eq=False)
class WorstElement:
    """The element with the least det J.

    number: in the file. kind, verdict: in words. lower_bound: proved, of det J over the magnitude of its mean on the
    element. least: the least value found, likewise, at parameters and at a point in the mesh's units.
    """

    number: int
    kind: str
    verdict: str
    lower_bound: float
    least: float
    parameters: tuple[float, float, float]
    point: tuple[float, float, float]

    def __str__(self) -> str:
        found = f"det J is {self.least:.4g} of its mean at {in_brackets(self.point)}"
        bound = f", >= {self.lower_bound:.4g} on the whole" if self.verdict == "positive" else ""
        return f"element {self.number}, {self.kind}, {self.verdict}: {found}{bound}"


@dataclass(frozen=True, eq=False)
class MeshCertificate:
    """What is proved of a volume mesh.

    Attributes
    ----------
    mesh : VolumeMesh
        As given.
    blocks : tuple of ElementsCertificate
        Of the elements, by kind, in the mesh's order.
    overlap : OverlapCheck
        Whether elements overlap.

    Examples
    --------
    >>> import numpy as np
    >>> import iga_nn
    >>> corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    >>> cube = iga_nn.VolumeMesh.of(np.array(corners), {"hexahedron": [range(8)]})
    >>> found = iga_nn.certify_mesh(cube)
    >>> found.verdict, found.one_to_one
    ('certified', 'yes')
    """

    mesh: VolumeMesh
    blocks: tuple[ElementsCertificate, ...]
    overlap: OverlapCheck

    @cached_property
    def verdicts(self) -> IntArray:
        """Return the verdict on each element, block after block: POSITIVE and so on of `search`."""
        return np.concatenate([block.verdicts for block in self.blocks])

    @property
    def verdict(self) -> MeshVerdict:
        """Return "folded" where det J is negative somewhere, "flat" where it is zero, "certified" or "undecided"."""
        if np.isin(self.verdicts, (FOLDED, INVERTED)).any():
            return "folded"
        if np.any(self.verdicts == FLAT):
            return "flat"
        return "certified" if not self.mesh.unchecked and np.all(self.verdicts == POSITIVE) else "undecided"

    @property
    def one_to_one(self) -> str:
        """Return whether no point is in the inside of two elements, and none folds: "yes", "no" or "undecided"."""
        if self.verdict == "folded" or self.overlap.overlap:
            return "no"
        return "yes" if self.verdict == "certified" and self.overlap.overlap is False else "undecided"

    @property
    def is_proved(self) -> bool:
        """Return whether det J has one sign on all elements, and they do not overlap."""
        return self.one_to_one == "yes"

    @property
    def orientation(self) -> str:
        """Return "right-handed", or "left-handed" where most elements have det J < 0: then -det J is examined."""
        return "right-handed" if self.blocks[0].sign > 0 else "left-handed"

    @property
    def lower_bound(self) -> float:
        """Return the least of the proved bounds of det J, each over the magnitude of the mean on its element."""
        return min(float(block.lower.min()) for block in self.blocks)

    @property
    def scaled_jacobian(self) -> float:
        """Return the least of the proved bounds of the scaled Jacobian, see `ElementsCertificate`."""
        return min(float(block.scaled.min()) for block in self.blocks)

    @property
    def volume(self) -> float:
        """Return the sum of the elements' volumes, in the mesh's units."""
        return abs(sum(float(block.volumes.sum()) for block in self.blocks))

    def bad(self, verdict: int) -> IntArray:
        """Return the numbers in the file of the elements with a verdict, such as FOLDED."""
        return self.mesh.numbers[self.verdicts == verdict]

    @property
    def defects(self) -> tuple[str, ...]:
        """Return what keeps the mesh from being certified: elements by their verdict and numbers, unchecked ones."""
        words = {
            INVERTED: "inverted, det J of the other sign all over",
            FOLDED: "folded, det J of the other sign at a point",
            FLAT: "flat, det J zero at a point",
            UNDECIDED: "undecided",
        }
        found = ((self.bad(verdict).tolist(), text) for verdict, text in words.items())
        lines = [f"{_elements(len(own))} {text}: {listed(own, SHOWN)}" for own, text in found if own]
        return (*lines, *(f"not checked: {count} {kind}" for kind, count in self.mesh.unchecked.items()))

    @cached_property
    def worst(self) -> WorstElement:
        """Return the element with the least value of det J over its mean; of a proved mesh that of the least bound."""
        by_bound = bool(np.all(self.verdicts == POSITIVE))
        rows = [(block.lower if by_bound else block.least) for block in self.blocks]
        number = int(np.argmin([float(row.min()) for row in rows]))
        block, found = self.mesh.blocks[number], self.blocks[number]
        row = int(rows[number].argmin())
        place = found.witnesses[row]
        return WorstElement(
            int(block.numbers[row]),
            str(block.kind),
            WORDS[found.verdicts[row]],
            float(found.lower[row]),
            float(found.least[row]),
            _triple(place),
            _triple(point_of(self.mesh, number, row, place)),
        )

    def __str__(self) -> str:
        start = f"{self.verdict}, {len(self.mesh)} elements, {self.orientation}"
        return "; ".join([start, *self.defects, str(self.worst), f"one-to-one: {self.one_to_one}"])

    def as_dict(self) -> dict[str, Any]:
        """Return the facts for a report."""
        worst, overlap = self.worst, self.overlap
        return {
            "bijective": self.verdict,
            "one_to_one": self.one_to_one,
            "orientation": self.orientation,
            "elements": self.mesh.counts,
            "not_checked": dict(self.mesh.unchecked),
            "nodes": len(self.mesh.points),
            "verdicts": {WORDS[k]: int(np.count_nonzero(self.verdicts == k)) for k in range(len(WORDS))},
            "bad_elements": {WORDS[k]: self.bad(k).tolist() for k in range(1, len(WORDS)) if len(self.bad(k))},
            "worst": vars(worst),
            "det_lower_bound": self.lower_bound,
            "scaled_jacobian": self.scaled_jacobian,
            "volume": self.volume,
            "overlap": vars(overlap),
        }


def _elements(count: int) -> str:
    return "1 element" if count == 1 else f"{count} elements"


def _triple(place: Array) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z


def point_of(mesh: VolumeMesh, block: int, row: int, place: Array) -> Array:
    """Return the point (3,) of an element at parameters (3,)."""
    own = mesh.blocks[block]
    return point_at(own.kind, mesh.points[own.nodes[row]], place)


def certify_mesh(mesh: VolumeMesh, *, max_depth: int = 10) -> MeshCertificate:
    """Decide whether det J has one sign on all elements, and whether these overlap.

    Parameters
    ----------
    mesh : VolumeMesh
        Such as one of `load_mesh`. Its coordinates are taken as exact.
    max_depth : int
        How often a doubtful element is cut in eight at most.

    Returns
    -------
    MeshCertificate
        With the verdict on each element, the worst one, and a place where elements overlap.

    Raises
    ------
    ValueError
        For a negative depth.

    Examples
    --------
    >>> import numpy as np
    >>> import iga_nn
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> inverted = iga_nn.VolumeMesh.of(np.array(corners), {"tetra": [[0, 1, 2, 3], [0, 2, 1, 3]]})
    >>> iga_nn.certify_mesh(inverted).verdict
    'folded'
    """
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    nodes = [mesh.points[block.nodes] for block in mesh.blocks]
    sign = _sign(mesh, nodes)
    blocks = tuple(
        certify_elements(block.kind, own, sign=sign, max_depth=max_depth)
        for block, own in zip(mesh.blocks, nodes, strict=True)
    )
    if all(block.is_proved for block in blocks):
        scaled = min(float(block.scaled.min()) for block in blocks)
        return MeshCertificate(mesh, blocks, check_overlap(mesh, sign, scaled))
    unknown = OverlapCheck(None, "it is looked for where det J is proved on all elements")
    return MeshCertificate(mesh, blocks, unknown)


def _sign(mesh: VolumeMesh, nodes: list[Array]) -> int:
    """Return the sign of det J on most elements, by the volume of the hexahedra or tetrahedra of their corners."""
    negative = 0
    for block, own in zip(mesh.blocks, nodes, strict=True):
        corners = own[:, : block.kind.corner_count]
        first, ends = (corners[:, 0], [1, 2, 3]) if block.kind.shape == "tetra" else (corners[:, 0], [1, 3, 4])
        edges = corners[:, ends] - first[:, None]
        if block.kind.shape == "hexahedron":
            low, high = corners[:, :4], corners[:, 4:]
            along = low[:, [1, 2]] - low[:, [0, 3]] + high[:, [1, 2]] - high[:, [0, 3]]
            across = low[:, [3, 2]] - low[:, [0, 1]] + high[:, [3, 2]] - high[:, [0, 1]]
            edges = np.stack([along.sum(axis=1), across.sum(axis=1), (high - low).sum(axis=1)], axis=1)
        negative += int(np.count_nonzero(np.linalg.det(edges) < 0.0))
    return -1 if 2 * negative > len(mesh) else 1
