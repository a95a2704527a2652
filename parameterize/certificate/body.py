"""The certificate of a body: det J of one sign on every patch, and patches on opposite sides of every interface.

The traces of two patches are equal at their interface: MultiPatch demands it. Then the map is one-to-one near every
point but those of lines where many patches meet. That it is one-to-one there, and at large, follows from the outer
boundary (boundary.py), by the theorem in docs/certificate.md.
"""

from dataclasses import dataclass
from typing import Literal, overload

from ..arrays import in_brackets
from ..display import Shown
from ..spline.interface import Interface
from ..spline.multipatch import MultiPatch, as_multipatch
from ..spline.volume import BSplineVolume
from .gluing import on_one_side
from .jacobian import Certificate, certify_patch


@dataclass(frozen=True)
class BodyCertificate(Shown):
    """The certificates of the patches of a body, and of its interfaces.

    Attributes
    ----------
    patches : tuple of Certificate
        In the order of the body's patches; each patch may be right-handed or left-handed.
    misglued : tuple of Interface
        Interfaces whose two patches, certified, lie on the same side: one is folded back over the other.

    Examples
    --------
    >>> import iga_nn
    >>> left = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=4)
    >>> back = iga_nn.BSplineVolume.from_function(lambda u, v, w: (1 - u / 2, v, w), control_points=4)
    >>> body = iga_nn.MultiPatch.from_patches([left, back])
    >>> print(iga_nn.certify(body))
    folded: both patches lie on the same side of p0_u1 = p1_u0
    """

    patches: tuple[Certificate, ...]
    misglued: tuple[Interface, ...] = ()

    @property
    def verdict(self) -> Literal["certified", "folded", "undecided"]:
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
        patches = (f"p{k}: {_defect(patch)}" for k, patch in enumerate(self.patches) if patch.verdict != "certified")
        return (*patches, *(f"both patches lie on the same side of {interface}" for interface in self.misglued))

    def __str__(self) -> str:
        if self.verdict == "certified":
            return f"certified, |det J| >= {self.lower_bound:.3g} of its mean"
        return f"{self.verdict}: {'; '.join(self.defects)}"


def _defect(patch: Certificate) -> str:
    """Return where a patch is folded or flat, or on how many spans it is not proved."""
    if patch.witness is not None:
        return f"folded at {in_brackets(patch.witness)}"
    if patch.flat is not None:
        return f"det J is zero, up to rounding, at {in_brackets(patch.flat)}"
    return f"{patch.claim} not proved on {len(patch.unproved)} knot spans"


@overload
def certify(body: BSplineVolume, *, max_depth: int = 6) -> Certificate: ...
@overload
def certify(body: MultiPatch, *, max_depth: int = 6) -> BodyCertificate: ...
def certify(body: BSplineVolume | MultiPatch, *, max_depth: int = 6) -> Certificate | BodyCertificate:
    """Decide whether det J has one sign on every patch, and whether patches lie on opposite sides of their interfaces.

    Parameters
    ----------
    body : BSplineVolume or MultiPatch
        The map.
    max_depth : int
        0 or more: how often a doubtful span is cut in eight at most; each cut makes the bounds on the pieces closer.

    Returns
    -------
    Certificate or BodyCertificate
        That of a volume, or those of all patches with one verdict.

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
    several = as_multipatch(body)
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    patches = tuple(certify_patch(patch, max_depth) for patch in several)
    if not isinstance(body, MultiPatch):
        return patches[0]
    signs = [-1 if patch.left_handed else 1 for patch in patches]
    proved = [patch.verdict == "certified" for patch in patches]
    misglued = (
        interface
        for interface in body.interfaces
        if proved[interface.first[0]] and proved[interface.second[0]] and on_one_side(interface, signs)
    )
    return BodyCertificate(patches, tuple(misglued))
