"""Rounds numbers for a reader: what is more than nothing is never shown as 0."""


def rounded(value: float, digits: int) -> str:
    """Return a number of at least zero with so many decimals; "below 0.01" in place of a zero that is none."""
    least = 10.0**-digits
    if value > 0.0 and round(value, digits) < least:
        return f"below {least:.{digits}f}"
    return f"{value:,.{digits}f}"
