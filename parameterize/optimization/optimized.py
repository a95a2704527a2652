"""A map as the rounds find it: control points, and what is proved of them."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Knots
from ..certificate.boundary import check_boundary
from ..certificate.jacobian import Certificate, certify
from ..spline.volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class Optimized:
    """Control points (3, n_u, n_v, n_w) at volume 1, and what is proved of them.

    injective: True where the boundary is proved not to meet itself, False where it was found to, None where that is not
    decided; it is asked of certified maps alone.
    """

    control: Array
    certificate: Certificate
    injective: bool | None

    @classmethod
    def of(cls, control: Array, knots: Knots, degree: int) -> "Optimized":
        """Certify control points and, where that succeeds, check their boundary."""
        volume = BSplineVolume((degree,) * 3, knots, np.moveaxis(control, 0, -1))
        certificate = certify(volume)
        injective = check_boundary(volume).injective if certificate.verdict == "certified" else None
        return cls(control, certificate, injective)

    @property
    def meets_itself(self) -> bool:
        """Whether the boundary of a certified map was found to meet itself."""
        return self.injective is False

    @property
    def faults(self) -> tuple[int, bool]:
        """What keeps the map from being one-to-one; fewer unproved spans count first."""
        return len(self.certificate.unproved), self.meets_itself

    @property
    def rank(self) -> tuple[int, bool, bool]:
        """The faults, and whether the boundary is undecided: of two maps the one with the lower rank is better."""
        return *self.faults, self.injective is None
