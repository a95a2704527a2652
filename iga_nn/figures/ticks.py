"""Gives logarithmic axes few ticks, with numbers in plain letters: matplotlib's own take as long as a rendered view."""

from matplotlib.axis import Axis
from matplotlib.ticker import AutoLocator, LogLocator, NullLocator

MULTIPLES = (1,), (1, 2, 5)  # of powers of ten
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Powers(LogLocator):
    """Ticks at powers of ten; at 2 and 5 times these, too, or at even steps, where fewer than two are seen."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the places of the ticks from vmin to vmax."""
        for multiples in MULTIPLES:
            self.set_params(subs=multiples)
            ticks = list(super().tick_values(vmin, vmax))
            if sum(vmin <= tick <= vmax for tick in ticks) > 1:
                return ticks
        return [tick for tick in AutoLocator().tick_values(vmin, vmax) if vmin <= tick <= vmax]


def in_powers(value: float, _: float = 0.0) -> str:
    """Return a number in eight digits at most as text, such as 10⁻³, 2.5·10⁴ or 3.125."""
    if value == 0.0:
        return "0"
    factor, power = f"{value:.7e}".split("e")
    ten = f"10{str(int(power)).translate(RAISED)}"
    if float(factor) == 1.0:
        return ten
    return f"{float(factor):.8g}·{ten}" if int(power) else f"{float(factor):.8g}"


def show_powers(axis: Axis) -> None:
    """Give a logarithmic axis few ticks, and their numbers as `in_powers`."""
    axis.set_major_locator(Powers())
    axis.set_major_formatter(in_powers)
    axis.set_minor_locator(NullLocator())
