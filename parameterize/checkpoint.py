"""Checkpoints of a run: arrays and a JSON header in one safetensors file, replaced as a whole.

A checksum over both is kept with them: a damaged file is refused.
"""

import hashlib
import json
from collections.abc import Mapping
from copy import copy
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_bytes

from .files import save_bytes

FORMAT = 12  # a file of another one is refused by name
KEPT = {  # the checkpoints of a run by their names, in the order of its stages, and what they hold
    "choice": "the way that the body takes",
    "first": "the blocks that are laid",
    "training": "the training",
    "sphere": "the layout on the sphere",
    "spline": "the rounds of the spline",
    "knots": "the refinement",
    "solve": "the levels that are solved",
    "steps": "the load steps",
}
_ANEW = "start anew with --force instead of --resume"
_DAMAGED = "remove this file to continue from an earlier checkpoint, or start anew with --force"


class CheckpointError(ValueError):
    """A checkpoint that does not belong to this run, or cannot be read."""


class Checkpoints:
    """The checkpoint files of one run in one folder.

    identity: the surface and all options of the run, as plain JSON values; a checkpoint of another run is refused.
    folder None keeps nothing; `resume` False removes the checkpoints (KEPT) that are there.
    """

    def __init__(self, folder: Path | None, identity: Mapping[str, Any], *, resume: bool) -> None:
        self._folder, self._resume, self._suffix, self._options = folder, resume, "", ""
        self._identity = json.dumps(identity, sort_keys=True)
        if folder is not None and not resume:
            for path in [path for name in KEPT for path in folder.glob(f"{name}*.safetensors")]:
                path.unlink()

    @classmethod
    def none(cls) -> "Checkpoints":
        """Return checkpoints that keep nothing."""
        return cls(None, {}, resume=False)

    def of_part(self, name: str | int) -> "Checkpoints":
        """Return the checkpoints of another part of the run, in files of their own."""
        other = copy(self)
        other._suffix += f"-{name}"
        return other

    def with_options(self, options: Mapping[str, Any]) -> "Checkpoints":
        """Return the checkpoints of a stage with options of its own: those with others are passed over, not refused."""
        other = copy(self)
        other._options = json.dumps(options, sort_keys=True)
        return other

    def check(self) -> None:
        """Raise CheckpointError where one of the files in the folder, of any part, is of another version or run.

        Only their headers are read; a damaged file is refused when it is loaded.
        """
        for path in sorted(self._folder.glob("*.safetensors")) if self._folder is not None else []:
            try:
                with safe_open(path, framework="np") as file:
                    header = file.metadata() or {}
                found = json.loads(header["identity"])
            except (SafetensorError, OSError, LookupError, ValueError):
                continue
            _demand_format(path, header)
            self._demand_own(path, found)

    def _demand_own(self, path: Path, found: Any) -> None:
        """Raise CheckpointError for a checkpoint with another identity."""
        if names := differing(json.loads(self._identity), found):
            raise CheckpointError(f"{path}: belongs to another run (different: {', '.join(names)}); {_ANEW}")

    def save(self, name: str, arrays: Mapping[str, NDArray[Any]], state: Mapping[str, Any]) -> None:
        """Write checkpoint `name`, replacing an older one. Raises OSError naming the file, say on a full disk."""
        if self._folder is None:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        header = {"format": str(FORMAT), "identity": self._identity, "state": json.dumps(state)}
        header |= {"options": self._options} if self._options else {}
        copies = {key: np.array(array, order="C") for key, array in arrays.items()}  # the file format takes no views
        content = to_bytes(copies, metadata=header | {"sha256": _digest(copies, header)})
        save_bytes(self._folder / f"{name}{self._suffix}.safetensors", content)

    def load(self, name: str) -> tuple[dict[str, NDArray[Any]], dict[str, Any]] | None:
        """Return arrays and state of checkpoint `name`; None where there is none, or the run starts afresh."""
        if self._folder is None or not self._resume:
            return None
        path = self._folder / f"{name}{self._suffix}.safetensors"
        if not path.exists():
            return None
        try:
            with safe_open(path, framework="np") as file:
                header = file.metadata() or {}
                arrays = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 - not a mapping
        except (SafetensorError, OSError, ValueError) as error:
            raise CheckpointError(f"{path}: not a readable checkpoint ({error}); {_DAMAGED}") from None
        _demand_format(path, header)
        if header.pop("sha256", None) != _digest(arrays, header):
            raise CheckpointError(f"{path}: not a readable checkpoint (damaged); {_DAMAGED}")
        self._demand_own(path, json.loads(header["identity"]))
        return (arrays, json.loads(header["state"])) if header.get("options", "") == self._options else None


def _demand_format(path: Path, header: Mapping[str, str]) -> None:
    """Raise CheckpointError for the header of another version."""
    if (written := header.get("format", "unknown")) != str(FORMAT):
        raise CheckpointError(
            f"{path}: written by another version of iga-nn (format {written}, this one reads {FORMAT}); {_ANEW}"
        )


def _digest(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, str]) -> str:
    """Return the SHA-256 of everything that a checkpoint holds."""
    return hashlib.sha256(to_bytes(dict(arrays)) + json.dumps(header, sort_keys=True).encode()).hexdigest()


def differing(wanted: Any, found: Any) -> list[str]:
    """Return the dotted names of the entries in which two identities, tables of plain JSON values, differ."""
    names: list[str] = []
    for key in sorted(wanted.keys() | found.keys()):
        ours, theirs = wanted.get(key), found.get(key)
        if isinstance(ours, dict) and isinstance(theirs, dict):
            names += [f"{key}.{name}" for name in differing(ours, theirs)]
        elif ours != theirs:
            names.append(key)
    return names
