"""Decides the sign of det J on every element of a kind: bounds on whole elements, then on parts of doubtful ones."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray, Mask
from .determinant import Coefficients, ElementForm, reference_corners
from .evaluation import exact_determinant
from .kinds import ElementKind

POSITIVE, INVERTED, FOLDED, FLAT, UNDECIDED = range(5)  # verdicts on an element
WORDS = ("positive", "inverted", "folded", "flat", "undecided")

_PIECES = 1024  # pieces at a time: a bound of the memory
_TIGHT = 0.9  # the least proved bound is refined until it is this share of the least known value
_MOST_EXACT = 300  # elements whose det J at a point is found without rounding: each takes milliseconds


@dataclass(frozen=True, eq=False)
class ElementsCertificate:
    """What is proved of det J on elements of one kind.

    Attributes
    ----------
    kind : ElementKind
        Of all of them.
    sign : int
        1, or -1 where -det J is examined: the elements are of the other orientation.
    verdicts : (n,) array of int
        POSITIVE (proved on the whole element), INVERTED (negative on the whole element), FOLDED (negative at a point),
        FLAT (zero at a point, without rounding, and nowhere found negative) or UNDECIDED.
    lower : (n,) array
        Proved lower bounds of det J, divided by the magnitude of its mean on the element.
    scaled : (n,) array
        Proved lower bounds of the scaled Jacobian: det J over the lengths of F_u, F_v, F_w; of tetrahedra times the
        root of 2, and with the largest of the products that belong to their corners. It is at most 1.
    volumes : (n,) array
        Integrals of det J, the signed volumes.
    witnesses : (n, 3) array
        Parameters of the point with the least value of det J met; not a number where none was looked for.
    least : (n,) array
        The value there, divided by the magnitude of the mean.

    Examples
    --------
    >>> from parameterize.meshes.kinds import kind_named
    >>> from parameterize.meshes.search import certify_elements
    >>> tetra = kind_named("tetra")
    >>> [round(volume, 6) for volume in certify_elements(tetra, tetra.lattice[None].astype(float)).volumes.tolist()]
    [0.166667]
    """

    kind: ElementKind
    sign: int
    verdicts: IntArray
    lower: Array
    scaled: Array
    volumes: Array
    witnesses: Array
    least: Array

    @property
    def is_proved(self) -> bool:
        """Return whether det J has the sign on all elements."""
        return bool(np.all(self.verdicts == POSITIVE))


def certify_elements(kind: ElementKind, nodes: Array, *, sign: int = 0, max_depth: int = 10) -> ElementsCertificate:
    """Decide whether det J is positive on the whole of each element.

    Parameters
    ----------
    kind : ElementKind
        Of all elements, such as `kind_named("hexahedron20")`.
    nodes : (n, nodes, 3) array
        Their nodes in VTK's order, taken as exact.
    sign : int
        1 for det J > 0, -1 for det J < 0, 0 for that of most elements.
    max_depth : int
        How often a doubtful element is cut in eight at most.

    Returns
    -------
    ElementsCertificate
        With arrays over the elements.

    Raises
    ------
    ValueError
        For another shape of the array, and numbers that are not finite.

    Examples
    --------
    >>> from parameterize.meshes.kinds import kind_named
    >>> from parameterize.meshes.search import certify_elements
    >>> tetra = kind_named("tetra")
    >>> certify_elements(tetra, tetra.lattice[None].astype(float)).is_proved
    True
    """
    nodes = np.asarray(nodes, dtype=np.float64)
    if nodes.ndim != 3 or nodes.shape[1:] != (len(kind.lattice), 3):
        raise ValueError(f"nodes of {kind} must have shape (n, {len(kind.lattice)}, 3), got {nodes.shape}")
    if not np.isfinite(nodes).all():
        raise ValueError("nodes must be finite")
    form = ElementForm(kind)
    found = form.coefficients(nodes)
    means = form.flat(found.values).mean(axis=1)
    sign = sign or (1 if np.count_nonzero(means < 0.0) * 2 <= len(means) else -1)
    return _Search(form, nodes, found, means, sign, max_depth).result()


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Parts of elements, all cut equally often."""

    depth: int
    owners: IntArray  # (k,) numbers of elements
    values: Array  # (k, ...) sign * det J
    places: Array  # (k, c, 3) parameters of the corners

    def rows(self, rows: Mask | slice) -> "_Pieces":
        return _Pieces(self.depth, self.owners[rows], self.values[rows], self.places[rows])


class _Search:
    """Depth-first subdivision of doubtful elements, many at once."""

    def __init__(
        self, form: ElementForm, nodes: Array, found: Coefficients, means: Array, sign: int, max_depth: int
    ) -> None:
        self.form, self.nodes, self.found, self.sign, self.max_depth = form, nodes, found, sign, max_depth
        rows = form.flat(found.values)
        self.means = np.where(means == 0.0, np.finfo(np.float64).tiny, np.abs(means))
        self.volumes = np.ldexp(means, found.exponents) / (6.0 if form.is_simplex else 1.0)
        least, most = (rows.min(axis=1), rows.max(axis=1)) if sign > 0 else (-rows.max(axis=1), -rows.min(axis=1))
        self.lower = least - found.errors
        corners = sign * rows[:, form.corners]
        worst = corners.argmin(axis=1)
        self.least = corners[np.arange(len(corners)), worst]  # least value met
        self.witnesses = reference_corners(form.kind)[worst]
        self.verdicts = np.where(self.lower > 0.0, POSITIVE, UNDECIDED)
        self.verdicts[most + found.errors < 0.0] = INVERTED
        self.flat_at = np.full((len(rows), 3), np.nan)
        self.target = np.zeros(len(rows))  # a bound above it is tight enough

    def result(self) -> ElementsCertificate:
        """Examine the doubtful elements, then those that may have the least value of all."""
        self._examine(np.flatnonzero(self.verdicts == UNDECIDED))
        self._settle_flat()
        if np.all(self.verdicts == POSITIVE) and len(self.verdicts):
            self._aim()
            self._examine(np.flatnonzero(self.lower < self.target))
        root = np.sqrt(2.0) if self.form.is_simplex else 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            scaled = np.where(self.found.sizes > 0.0, root * self.lower / self.found.sizes, 0.0)
        return ElementsCertificate(
            self.form.kind,
            self.sign,
            self.verdicts,
            self.lower / self.means,
            scaled,
            self.volumes,
            self.witnesses,
            self.least / self.means,
        )

    def _aim(self) -> None:
        """Set the bounds that are tight enough, by the least value met on all elements."""
        self.target = _TIGHT * float((self.least / self.means).min()) * self.means

    def _examine(self, numbers: IntArray) -> None:
        """Cut elements into parts until each is proved, folded or given up; their bounds become those of the parts."""
        for begin in range(0, len(numbers), _PIECES):
            own = numbers[begin : begin + _PIECES]
            values = self.sign * self.found.values[own]
            whole = np.broadcast_to(reference_corners(self.form.kind), (len(own), self.form.kind.corner_count, 3))
            self.closed = np.zeros(len(self.verdicts), dtype=bool)
            self.open = np.zeros(len(self.verdicts), dtype=bool)  # some part is neither proved nor folded
            self.lower[own] = np.inf
            stack = [_Pieces(0, own, values, whole)]
            while stack:
                top = stack.pop()
                if len(top.owners) > _PIECES:
                    stack.append(top.rows(slice(_PIECES, None)))
                    top = top.rows(slice(_PIECES))
                left = self._conclude(top)
                if len(left.owners):
                    values, places = self.form.parts(left.values), self.form.part_places(left.places)
                    stack.append(_Pieces(left.depth + 1, np.repeat(left.owners, 8), values, places))
            self.verdicts[own[(self.verdicts[own] == UNDECIDED) & ~self.open[own]]] = POSITIVE

    def _conclude(self, pieces: _Pieces) -> _Pieces:
        """Record which pieces are proved, folded or given up; return those that are cut next."""
        owners = pieces.owners
        errors = self.found.errors[owners] + self.form.halving_error(self.found.permanents[owners], pieces.depth)
        rows = self.form.flat(pieces.values)
        least = rows.min(axis=1)
        corners = rows[:, self.form.corners]
        worst = corners.argmin(axis=1)
        value, place = corners[np.arange(len(corners)), worst], pieces.places[np.arange(len(corners)), worst]
        if self._record_least(owners, value, place) and self.target.any():
            self._aim()
        folded = (value < -errors) & (self.verdicts[owners] != INVERTED)
        self.verdicts[owners[folded]] = FOLDED
        hopeless = (value <= errors) & (least >= -errors)  # det J is 0 at a corner, and no fold can show
        self.flat_at[owners[hopeless]] = place[hopeless]
        bounds = least - errors
        last = pieces.depth == self.max_depth
        done = (bounds > np.maximum(0.0, self.target[owners])) | hopeless | last
        self.open[owners[done & ~(bounds > 0.0)]] = True
        given_up = last & ~(bounds > 0.0) & ~hopeless
        self.closed[owners[folded | given_up]] = True
        done |= self.closed[owners]
        self.open[owners[done & ~(bounds > 0.0)]] = True
        np.minimum.at(self.lower, owners[done], bounds[done])
        return pieces.rows(~done)

    def _record_least(self, owners: IntArray, value: Array, place: Array) -> bool:
        """Keep the least value met on each element, and where it is; return whether one is smaller than before."""
        order = np.lexsort((value, owners))
        first = order[np.append(True, owners[order][1:] != owners[order][:-1])] if len(order) else order
        first = first[value[first] < self.least[owners[first]]]
        self.least[owners[first]] = value[first]
        self.witnesses[owners[first]] = place[first]
        return bool(len(first))

    def _settle_flat(self) -> None:
        """Find det J without rounding where it seemed to be zero: there it is zero, or has a sign after all."""
        doubtful = np.flatnonzero((self.verdicts == UNDECIDED) & np.isfinite(self.flat_at[:, 0]))
        for number in doubtful[:_MOST_EXACT].tolist():
            place = self.flat_at[number]
            value = self.sign * exact_determinant(self.form.kind, self.nodes[number], place)
            if value <= 0:
                self.verdicts[number] = FLAT if value == 0 else FOLDED
                self.witnesses[number] = place
                self.least[number] = float(value)
