"""The section G of an IGES file as text, and another unit in a file that OpenCASCADE wrote."""

from __future__ import annotations


def section(parameters, end="G"):
    """Lines of a section of an IGES file."""
    pieces = [parameters[k : k + 72] for k in range(0, len(parameters), 72)]
    return "".join(f"{piece:<72}{end}{k:7d}\n" for k, piece in enumerate(pieces, start=1))


def parameters(flag="2", name="2HMM", scale="1.", start=("", "")):
    """The text of a section G, with the delimiters at its start; they are a comma and a semicolon where it has none."""
    separator, end = (word[2:] or sign for word, sign in zip(start, ",;", strict=True))
    words = [*start, "4Hpart", "8Ha,b;c.ig", "3Hown", "1H1", "32", "38", "6", "308", "15", "4Hpart", scale, flag, name]
    rest = ["1", "0.", "13H260101.000000", "1.E-06", "9.", "2Hme", "2Hus", "11", "0", "13H260101.000000"]
    return separator.join([*words, *rest]) + end


def with_unit(data, flag, name):
    """A file of OpenCASCADE with another unit: the same numbers."""
    lines = data.decode().splitlines(keepends=True)
    others = {sign: [line for line in lines if line[72:73] == sign] for sign in "SDPT"}
    given = section(parameters(flag, name))
    count = f"G{given.count(chr(10)):7d}"
    last = others["T"][0]
    return "".join([*others["S"], given, *others["D"], *others["P"], last[:8] + count + last[16:]]).encode()
