"""Gives logarithmic axes few ticks, with numbers in plain letters: matplotlib's own take as long as a rendered view."""

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullLocator

MULTIPLES = (1,), (1, 2, 5), tuple(range(1, 10))  # of powers of ten
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Powers(LogLocator):
    """Ticks at powers of ten, or also at 2 and 5 times these, or at all multiples, so that two are seen if possible."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the places of the ticks from vmin to vmax."""
        for multiples in MULTIPLES:
            self.set_params(subs=multiples)
            ticks = np.asarray(super().tick_values(vmin, vmax))
            if np.count_nonzero((ticks >= vmin) & (ticks <= vmax)) > 1:
                break
        return list(ticks.tolist())


def in_powers(value: float, _: float = 0.0) -> str:
    """Return a number as text, such as 10⁻³ or 2.5·10⁴."""
    if value == 0.0:
        return "0"
    factor, power = f"{value:.3e}".split("e")
    ten = f"10{str(int(power)).translate(RAISED)}"
    return ten if float(factor) == 1.0 else f"{float(factor):g}·{ten}"


def show_powers(axis: Axis) -> None:
    """Give a logarithmic axis few ticks, and their numbers as `in_powers`."""
    axis.set_major_locator(Powers())
    axis.set_major_formatter(in_powers)
    axis.set_minor_locator(NullLocator())
