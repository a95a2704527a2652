"""Rounds numbers for a reader: a positive number is never shown as 0, and rounding errors are shown as no figure."""

import math

SHARE = 1e-12  # of the box's diagonal: distances below are rounding errors, those of exact blocks are some 1e-14
DISTORTION = 1e-20  # ARAP, a sum of squares: below, stretches differ from 1 by rounding errors
EXACT = "exact"  # in place of such a number


def rounded(value: float, digits: int) -> str:
    """Return a number of at least zero with some decimals; "below 0.01" for a positive number that rounds to zero."""
    least = 10.0**-digits
    if value > 0.0 and round(value, digits) < least:
        return f"below {least:.{digits}f}"
    return f"{value:,.{digits}f}"


def clock(seconds: float) -> str:
    """Return seconds as minutes and seconds, such as "1:05"; begun seconds count."""
    minutes, rest = divmod(math.ceil(max(0.0, seconds)), 60)
    return f"{minutes}:{rest:02d}"


def distance(share: float, digits: int = 3) -> str:
    """Return a distance over the box's diagonal with some significant digits; EXACT where it is a rounding error."""
    return EXACT if share < SHARE else f"{share:.{digits}g}"


def distortion(arap: float, digits: int = 4) -> str:
    """Return an ARAP distortion with some significant digits; EXACT where it is a rounding error."""
    return EXACT if arap < DISTORTION else f"{arap:.{digits}g}"
