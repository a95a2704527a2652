"""A map as the rounds find it, and what is proved of it."""

from dataclasses import dataclass

from ..certificate.boundary import check_boundary
from ..certificate.jacobian import Certificate, certify
from ..spline.spline_map import SplineMap


@dataclass(frozen=True, eq=False)
class Optimized:
    """A map at volume 1, and what is proved of it.

    injective: True where the boundary is proved not to meet itself, False where it was found to, None where that is not
    decided; it is asked of certified maps alone.
    """

    spline: SplineMap
    certificate: Certificate
    injective: bool | None

    @classmethod
    def of(cls, spline: SplineMap) -> "Optimized":
        """Certify a map and, where that succeeds, check its boundary."""
        volume = spline.volume
        certificate = certify(volume)
        injective = check_boundary(volume).injective if certificate.verdict == "certified" else None
        return cls(spline, certificate, injective)

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
