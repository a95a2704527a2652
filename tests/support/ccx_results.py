"""Reads results of CalculiX, .frd files as text."""

from pathlib import Path

import numpy as np

from iga_nn.io.calculix import Deck
from parameterize.arrays import Array


def displacement(path: Path, deck: Deck) -> Array:
    """Return the displacements (n, 3) at the nodes of a deck, NaN at those that the file lacks."""
    return values(path, "DISP", deck)[:, :3]


def temperature(path: Path, deck: Deck) -> Array:
    """Return the temperatures (n,) at the nodes of a deck, NaN at those that the file lacks."""
    return values(path, "NDTEMP", deck)[:, 0]


def values(path: Path, block: str, deck: Deck) -> Array:
    """Return the values (n, c) of the first block of a name."""
    rows, inside = [], False
    for line in path.read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == block
        elif line.startswith(" -3") and inside:
            break
        elif inside and line.startswith(" -1"):
            words = [line[i : i + 12] for i in range(13, len(line.rstrip()), 12)]
            rows.append([float(line[3:13]), *map(float, words)])
    table = np.array(rows)
    found = np.full((len(deck.numbers), table.shape[1] - 1), np.nan)
    places = np.zeros(deck.numbers.max() + 1, dtype=np.int64)
    places[deck.numbers] = np.arange(len(deck.numbers))
    found[places[table[:, 0].astype(np.int64)]] = table[:, 1:]
    return found
