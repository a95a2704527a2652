"""Rounds numbers for a reader: a positive number is never shown as 0."""


def rounded(value: float, digits: int) -> str:
    """Return a number of at least zero with some decimals; "below 0.01" for a positive number that rounds to zero."""
    least = 10.0**-digits
    if value > 0.0 and round(value, digits) < least:
        return f"below {least:.{digits}f}"
    return f"{value:,.{digits}f}"
