"""Finds the entries of data that are given by patch, {0: 210.0, 1: 8.0}, or by solid, {"steel": 210.0, "pad": 8.0}."""

from collections.abc import Collection, Mapping
from math import inf
from numbers import Real
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.solids import PatchSolids

Owner = int | str  # the number of a patch, or the name of a solid


def entry_of(given: Any, patch: int, solid: str) -> Any:
    """Return the entry of a patch of a solid, or what is given for all patches."""
    if not isinstance(given, Mapping):
        return given
    return given[solid] if solid in given else given[patch]


def demand_owners(name: str, given: Collection[Owner], solids: PatchSolids) -> None:
    """Raise ValueError if data are not given for each patch of a body, or for each of its solids, and for no others."""
    if any(isinstance(owner, str) for owner in given):
        _demand_solids(name, given, solids)
        return
    count = len(solids.numbers)
    if beyond := sorted(set(given) - set(range(count)), key=str):
        raise ValueError(f"{name}: there is no patch {beyond[0]!r}; the body has {count}, from 0 on")
    if missing := sorted(set(range(count)) - set(given)):
        raise ValueError(f"{name} has no entry for patch {missing[0]}: give one a patch")


def _demand_solids(name: str, given: Collection[Owner], solids: PatchSolids) -> None:
    """Raise ValueError for the names of solids that the body does not have, and for solids without an entry."""
    known = dict.fromkeys(solids.labels)
    if beyond := [owner for owner in given if owner not in known]:
        raise ValueError(f"{name}: there is no solid {beyond[0]!r}; the body has {solids.told}")
    if missing := [label for label in known if label not in given]:
        raise ValueError(f"{name} has no entry for solid {missing[0]!r}; the body has {solids.told}")


def of_each_patch(name: str, given: float | Mapping[Owner, float], solids: PatchSolids) -> Array:
    """Return a positive number for each patch (n,). Raises ValueError as `demand_owners`, and as `demand_positive`."""
    demand_positive(name, given)
    if not isinstance(given, Mapping):
        return np.full(len(solids.numbers), float(given))
    demand_owners(name, given.keys(), solids)
    each = enumerate(solids.of_patches)
    return np.array([entry_of(given, patch, solid) for patch, solid in each], dtype=np.float64)


def demand_positive(name: str, given: float | Mapping[Owner, float]) -> None:
    """Raise ValueError for a number, or for an entry of several, that is not positive and finite."""
    for value in given.values() if isinstance(given, Mapping) else (given,):
        if not (isinstance(value, Real) and 0.0 < value < inf):
            raise ValueError(f"{name} must be a positive number, got {value!r:.80}")
