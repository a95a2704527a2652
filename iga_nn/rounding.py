"""Rounds numbers for a reader: a positive number is never shown as 0."""

import math


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
