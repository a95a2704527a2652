"""Defines Ask: a number that a user asks of a solution, such as "ux at (10, 0, 0)" or "reaction z of u0"."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from .forms.frame import UnitFrame
from .forms.parser import ExpressionError
from .forms.region import Part, Region

Kind = Literal["at", "max", "min", "mean", "integral", "reaction", "flow", "energy", "frequency"]
Place = tuple[float, float, float]

FORMS = (
    "'ux at (10, 0, 0)', 'von_mises max over z > 20', 'mean T over nz > 0.9', 'reaction z of u0', 'flow over u1', "
    "'energy' or 'frequency 1'"
)
_NAME = r"(?P<quantity>[A-Za-z]\w*)"
_OVER_PARTS = r"(?P<kind>max|min|mean|integral)"
_REGION = r"(?P<region>.+)"
_PATTERNS = tuple(
    re.compile(pattern, re.DOTALL)
    for pattern in (
        rf"{_NAME}\s+(?P<kind>at)\s*(?P<place>.*)",
        rf"{_OVER_PARTS}\s+{_NAME}(?:\s+over\s+{_REGION})?",
        rf"{_NAME}\s+{_OVER_PARTS}(?:\s+over\s+{_REGION})?",
        rf"(?P<kind>reaction)(?:\s+(?P<direction>[xyz]))?\s+of\s+{_REGION}",
        rf"(?P<kind>flow)(?:\s+(?P<direction>[xyz]))?\s+over\s+{_REGION}",
        r"(?P<kind>energy)",
        r"(?P<kind>frequency)\s+(?P<number>[0-9]{1,6})",
    )
)


@dataclass(frozen=True)
class Ask:
    """A number that is asked of a solution: `iga_nn.solve(..., ask=["ux at (10, 0, 0)"])` answers it with an interval.

    Parameters
    ----------
    text : str
        One of "QUANTITY at (x, y, z)"; "QUANTITY max", min, mean or integral, each also before the quantity, of the
        whole body or "over REGION"; "reaction z of REGION"; "flow over REGION"; "energy"; "frequency 1". A quantity is
        ux, uy, uz, u or T of a scalar law, a name of the law's quantities with one number a point, such as von_mises,
        or a component of one, such as stress_xx or gradient_z. A region is a condition as in `Region`; one on position
        alone is a part of the body, any other is a part of its boundary.
    surface : Part, optional
        The part's surface mesh, which group:NAME and face(x, y, z) need.

    Raises
    ------
    ExpressionError
        For a text that is refused.

    Examples
    --------
    >>> import iga_nn
    >>> ask = iga_nn.Ask("von_mises max over z > 20")
    >>> ask.kind, ask.quantity, str(ask.region)
    ('max', 'von_mises', 'z > 20')
    """

    text: str
    surface: Part | None = field(default=None, repr=False, compare=False)
    kind: Kind = field(init=False, repr=False, compare=False)
    quantity: str = field(init=False, repr=False, compare=False)  # "" of reactions, flows, energy and frequencies
    place: Place | None = field(init=False, repr=False, compare=False)
    region: Region | None = field(init=False, repr=False, compare=False)  # None for the whole body
    direction: str = field(init=False, repr=False, compare=False)  # "x", "y" or "z" of a force, otherwise ""
    number: int = field(init=False, repr=False, compare=False)  # of a mode, from 1 on; otherwise 0

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise ExpressionError(f"ask must be text, such as {FORMS}, got {type(self.text).__name__}")
        if not isinstance(self.surface, Part | None):
            raise ExpressionError(f"{self.role}: surface must be a Part, got {type(self.surface).__name__}")
        text = " ".join(self.text.split())
        found = next((match for pattern in _PATTERNS if (match := pattern.fullmatch(text))), None)
        if found is None:
            raise ExpressionError(f"{self.role}: {_what_is_wrong(text)}; write {FORMS}")
        parts = found.groupdict()
        own = {
            "text": text,
            "kind": parts["kind"],
            "quantity": parts.get("quantity") or "",
            "place": self._place(parts["place"]) if "place" in parts else None,
            "region": self._region(parts["region"]) if parts.get("region") else None,
            "direction": parts.get("direction") or "",
            "number": int(parts.get("number") or 0),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)
        if self.kind == "frequency" and self.number == 0:
            raise ExpressionError(f"{self.role}: the first one is frequency 1")

    def __str__(self) -> str:
        return self.text

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the text for a pickle; the copy parses it again."""
        return Ask, (self.text, self.surface)

    @property
    def role(self) -> str:
        """Return the ask's name in messages."""
        return f"ask {self.text!r:.80}"

    @property
    def is_on_boundary(self) -> bool:
        """Return whether the region is a part of the boundary: where a face, a group or a normal occurs in it."""
        region = self.region
        return region is not None and (region.needs_cube or region.needs_normal or bool(region.patch_faces))

    def placed(self, frame: UnitFrame | None = None, surface: Part | None = None) -> "Ask":
        """Return the same ask with X, Y, Z of its region measured in a frame, and the region on a surface."""
        other = Ask(self.text, self.surface or surface)
        if self.region is not None:
            object.__setattr__(other, "region", self.region.placed(frame, surface))
        return other

    def _place(self, text: str) -> Place:
        try:
            x, y, z = (float(part) for part in text.strip().removeprefix("(").removesuffix(")").split(","))
        except ValueError:
            raise ExpressionError(f"{self.role}: a place is three numbers, as in 'at (10, 0, 0)'") from None
        if not np.all(np.isfinite([x, y, z])):
            raise ExpressionError(f"{self.role}: the numbers of a place must be finite")
        return x, y, z

    def _region(self, text: str) -> Region:
        try:
            return Region(text, self.surface)
        except ExpressionError as error:
            raise ExpressionError(f"{self.role}: {error}") from None


def asks_of(given: Any) -> tuple[Ask, ...]:
    """Return an ask, a text, or several of these as asks.

    Raises ExpressionError for a text that is refused, and where one is given twice.
    """
    if isinstance(given, str | Ask):
        given = [given]
    if not isinstance(given, Iterable):
        raise ExpressionError(f"ask must be a list of texts such as {FORMS}, got {given!r:.80}")
    found: dict[str, Ask] = {}
    for one in given:
        ask = one if isinstance(one, Ask) else Ask(one)
        if ask.text in found:
            raise ExpressionError(f"{ask.role}: is asked twice; leave one out")
        found[ask.text] = ask
    return tuple(found.values())


def _what_is_wrong(text: str) -> str:
    """Return what a text that is no ask lacks."""
    first = text.partition(" ")[0]
    if not text:
        return "is empty"
    if first in ("reaction", "flow"):
        return f"a {first} has a region, as in '{first} {'z of' if first == 'reaction' else 'over'} u0'"
    if first == "frequency":
        return "a frequency has the number of its mode, as in 'frequency 1'"
    if re.fullmatch(_NAME, text):
        return f"says neither where nor what of {text!r}: at (x, y, z), max, min, mean or integral"
    return "is no ask"
