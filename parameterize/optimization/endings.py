"""Defines what a spline stage gives: its map with the certificate, the course of the rounds, and why they end."""

from collections import Counter
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from ..arrays import IntArray
from ..certificate.boundary import check_boundary
from ..certificate.certify import Certificate, certify
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


class Reason(StrEnum):
    """Name a reason for which a phase ends, with a sentence that explains it."""

    sentence: str

    GROWN = "grown", "all of the surface's data draw F."
    SHAPED = "shaped", "the rounds that shape F are done."
    CERTIFIED = "certified", "det J > 0 is proved."
    APART = "apart", "the boundary was not found to meet itself."
    POLISHED = "certified and polished", "all of the surface's data have their whole weight again."
    LESS_POLISHED = "certified, less polished", "some of the surface's data still have less weight; no polish is left."
    FOLDS_AGAIN = "folds again in polish", "the data cannot have more weight: F folds more with it."
    MEETS_ITSELF = "still meets itself", "the rounds that push the boundary apart are used up."
    DRIFTED_AWAY = "drifted away while parting", "the boundary meets itself, and F is too far from the surface."
    STALLED = "stalled", "too many rounds have not halved the number of unproved spans."
    TOO_MANY_FOLDED = "too many folded spans", "more spans are folded than can be watched one by one."
    TOO_FAR = "too far from the surface", "F is folded, and not close to the surface either."
    EXACT = "exact", "the blocks are the body, and nothing is left to optimise."
    LAID = "laid", "the blocks follow the outlines of the body, and are left as they are."
    CURVED = "curved", "the hexahedra are curved onto the part, and are left as they are."
    OUT_OF_TIME = "out of time", "the time limit leaves no time for another round."
    OUT_OF_ROUNDS = "out of rounds", "the stage has had all its rounds."

    def __new__(cls, name: str, sentence: str) -> "Reason":
        """Return a member whose value is its name."""
        reason = str.__new__(cls, name)
        reason._value_, reason.sentence = name, sentence
        return reason

    @property
    def ends_the_rounds(self) -> bool:
        """Return whether no other phase follows."""
        return self not in (Reason.GROWN, Reason.SHAPED, Reason.CERTIFIED, Reason.APART)


@dataclass(frozen=True)
class Course:
    """Describe the rounds of a spline stage: their number and wall seconds by phase, and the reason of their end."""

    rounds: Counter[str]
    seconds: dict[str, float]
    ending: Reason

    def after(self, earlier: "Course") -> "Course":
        """Return the course of two parts of the rounds, `earlier` and this one, with the ending of this one."""
        names = earlier.seconds | self.seconds
        seconds = {name: earlier.seconds.get(name, 0.0) + self.seconds.get(name, 0.0) for name in names}
        return Course(earlier.rounds + self.rounds, seconds, self.ending)
