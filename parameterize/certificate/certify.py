"""The certificate of a body: det J of one sign on every patch, and patches on opposite sides of every interface.

The traces of two patches are equal at their interface: Body demands it. Then the map is one-to-one near every
point but those of lines where many patches meet. That it is one-to-one there, and at large, follows from the outer
boundary (boundary.py), by the theorem in docs/certificate.md.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import IntArray, in_brackets
from ..display import Shown
from ..spline.body import Body, BodyLike, as_body
from ..spline.interface import Interface
from ..spline.patch_groups import groups_of
from .gluing import on_one_side
from .jacobian import Parameters, PatchCertificate, Verdict, certify_patches

SHOWN = 5  # defects of a body


@dataclass(frozen=True)
class Certificate(Shown):
    """The certificates of the patches of a body, and of its interfaces.

    That of a volume, a body of one patch, has this patch's `mean_det`, `witness`, `unproved`, `flat`, `left_handed`,
    `orientation` and `claim`, see `PatchCertificate`; that of several raises ValueError for them.

    Attributes
    ----------
    patches : tuple of PatchCertificate
        In the order of the body's patches; each patch may be right-handed or left-handed.
    misglued : tuple of Interface
        Interfaces whose two patches, certified, lie on the same side: one is folded back over the other.

    Examples
    --------
    >>> import iga_nn
    >>> left = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=4)
    >>> back = iga_nn.BSplineVolume.from_function(lambda u, v, w: (1 - u / 2, v, w), control_points=4)
    >>> body = iga_nn.Body.from_patches([left, back])
    >>> print(iga_nn.certify(body))
    folded: both patches lie on the same side of p0_u1 = p1_u0
    """

    patches: tuple[PatchCertificate, ...]
    misglued: tuple[Interface, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """Return "folded" where a patch is or an interface is misglued, "certified" where every patch is."""
        if self.misglued or any(patch.verdict == "folded" for patch in self.patches):
            return "folded"
        return "certified" if all(patch.verdict == "certified" for patch in self.patches) else "undecided"

    @property
    def lower_bound(self) -> float:
        """Return the smallest of the lower bounds of the patches, each relative to the mean of its own patch."""
        return min(patch.lower_bound for patch in self.patches)

    @property
    def volume(self) -> float:
        """Return the sum of the patches' volumes, in the body's units."""
        return sum(abs(patch.mean_det) for patch in self.patches)

    @property
    def defects(self) -> tuple[str, ...]:
        """Return what keeps the body from being certified, each patch by its number and each interface by its name."""
        defects = [_defect(patch) for patch in self.patches]
        named = defects if len(defects) == 1 else [defect and f"p{k}: {defect}" for k, defect in enumerate(defects)]
        misglued = (f"both patches lie on the same side of {interface}" for interface in self.misglued)
        return (*filter(None, named), *misglued)

    @property
    def first_defects(self) -> tuple[str, ...]:
        """Return the first defects, and how many more there are: a body may have thousands of patches."""
        first, rest = self.defects[:SHOWN], len(self.defects) - SHOWN
        return (*first, f"and {rest} more") if rest > 0 else first

    @property
    def only(self) -> PatchCertificate:
        """Return the certificate of the patch of a body of one. Raises ValueError for several."""
        if len(self.patches) > 1:
            raise ValueError(f"this certificate is that of {len(self.patches)} patches: use certificate.patches[i]")
        return self.patches[0]

    @property
    def mean_det(self) -> float:
        """Return the integral of det J over the cube, the signed volume."""
        return self.only.mean_det

    @property
    def witness(self) -> Parameters | None:
        """Return a point where det J has the wrong sign; None unless folded."""
        return self.only.witness

    @property
    def unproved(self) -> IntArray:
        """Return the numbers (k, 3) of the spans on which the sign of det J was not proved."""
        return self.only.unproved

    @property
    def flat(self) -> Parameters | None:
        """Return a point of an undecided volume where det J is zero, up to rounding; None where none was met."""
        return self.only.flat

    @property
    def left_handed(self) -> bool:
        """Return whether det J is negative on the whole."""
        return self.only.left_handed

    @property
    def orientation(self) -> str:
        """Return "right-handed" or "left-handed": that of u, v, w in space."""
        return self.only.orientation

    @property
    def claim(self) -> str:
        """Return the claim that the verdict decides: "det J > 0", or "det J < 0" for a left-handed volume."""
        return self.only.claim

    def __str__(self) -> str:
        if self.verdict == "certified":
            return f"certified, |det J| >= {self.lower_bound:.3g} of its mean"
        return f"{self.verdict}: {'; '.join(self.first_defects)}"


def _defect(patch: PatchCertificate) -> str:
    """Return where a patch is folded or flat, or on how many spans it is not proved; "" for a certified patch."""
    if patch.verdict == "certified":
        return ""
    if patch.witness is not None:
        return f"folded at {in_brackets(patch.witness)}"
    if patch.flat is not None:
        return f"det J is zero, up to rounding, at {in_brackets(patch.flat)}"
    return f"{patch.claim} not proved on {len(patch.unproved)} knot spans"


def certify(body: BodyLike, *, max_depth: int = 6) -> Certificate:
    """Decide whether det J has one sign on every patch, and whether patches lie on opposite sides of their interfaces.

    Parameters
    ----------
    body : BSplineVolume or Body
        The map.
    max_depth : int
        0 or more: how often a doubtful span is cut in eight at most; each cut makes the bounds on the pieces closer.

    Returns
    -------
    Certificate
        Those of all patches with one verdict; of a volume also what is known of its only patch.

    Raises
    ------
    TypeError
        For another object.
    ValueError
        For a negative depth, or where derivatives overflow.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> certificate = iga_nn.certify(benchmark_volume(4))
    >>> certificate.verdict, certificate.lower_bound > 0, certificate.witness
    ('certified', True, None)
    """
    glued = as_body(body)
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    patches: list[Any] = [None] * len(glued)
    for group in groups_of(glued.patches):  # afresh: arrays of a patch may have changed since the body was made
        for number, certificate in zip(group.numbers, certify_patches(glued.patches, group, max_depth), strict=True):
            patches[number] = certificate
    return Certificate(tuple(patches), tuple(_misglued(glued, patches)))


def _misglued(body: Body, patches: Sequence[PatchCertificate]) -> Iterator[Interface]:
    """Yield the interfaces whose two patches, certified, lie on the same side."""
    signs = np.array([-1 if patch.left_handed else 1 for patch in patches])
    proved = np.array([patch.verdict == "certified" for patch in patches])
    rows = body.interface_rows
    wrong = proved[rows[:, [0, 2]]].all(axis=1) & on_one_side(rows, signs)
    return (body.interfaces[number] for number in np.flatnonzero(wrong))
