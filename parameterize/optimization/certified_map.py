"""Holds a map that the rounds have found, with the results of its certificate."""

from dataclasses import dataclass
from functools import cached_property

from ..arrays import IntArray
from ..certificate.body import Certificate, certify
from ..certificate.boundary import check_boundary
from ..spline.spline_map import SplineMap
from .spans import in_blocks


@dataclass(frozen=True, eq=False)
class CertifiedMap:
    """Hold a map at volume 1 and the results of its certificate.

    injective: True where the boundary is proved not to meet itself, False where the boundary was found to meet itself,
    None where neither is decided; only the boundary of a certified map is examined.
    """

    spline: SplineMap
    certificate: Certificate
    injective: bool | None

    @classmethod
    def of(cls, spline: SplineMap) -> "CertifiedMap":
        """Certify a map and, once it is certified, check its boundary."""
        body = spline.body
        certificate = certify(body)
        injective = check_boundary(body).injective if certificate.verdict == "certified" else None
        return cls(spline, certificate, injective)

    @cached_property
    def unproved(self) -> IntArray:
        """Return the spans (k, 4) of all blocks on which det J > 0 is not proved."""
        return in_blocks([patch.unproved for patch in self.certificate.patches])

    @property
    def meets_itself(self) -> bool:
        """Return whether the boundary of a certified map was found to meet itself."""
        return self.injective is False

    @property
    def faults(self) -> tuple[int, bool]:
        """Return the number of unproved spans, which counts first, and whether the boundary meets itself."""
        return len(self.unproved), self.meets_itself

    @property
    def rank(self) -> tuple[int, bool, bool]:
        """Return the faults, and whether the boundary is undecided: of two maps that with the lower rank is better."""
        return *self.faults, self.injective is None
