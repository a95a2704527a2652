"""Makes the tetrahedra of a part by Netgen, in a process of its own, which has limits and may crash."""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from ...arrays import Array
from .mesh import TetrahedralMesh

PROGRAM = Path(__file__).with_name("netgen_program.py")
PATIENCE = 120.0  # seconds
_SHORTER = 0.5  # times the edges where a mesh is made finer


class MesherError(Exception):
    """The mesher makes no tetrahedra of a part; the message says why."""


@dataclass(frozen=True)
class Sizes:
    """Say how long the edges of tetrahedra may be.

    largest: in the part's unit. around: edges around a full circle. growth: how fast edges may grow, 0.1 to 1.
    places: (k, 4) points with the largest edge there.
    """

    largest: float
    around: float
    growth: float = 0.7
    places: Array = field(default_factory=lambda: np.empty((0, 4)))

    def shorter_at(self, corners: Array) -> "Sizes":
        """Return the sizes with half the mean edge at the centres and corners of simplices (k, n, 3)."""
        pairs = np.array(list(combinations(range(corners.shape[1]), 2)))
        edges = np.linalg.norm(corners[:, pairs[:, 0]] - corners[:, pairs[:, 1]], axis=2)
        places = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
        lengths = np.broadcast_to(_SHORTER * edges.mean(axis=1)[:, None, None], (*places.shape[:2], 1))
        added = np.concatenate([places, lengths], axis=2).reshape(-1, 4)
        return replace(self, places=np.concatenate([self.places, added]))


def tetrahedra_of_brep(text: bytes, sizes: Sizes) -> TetrahedralMesh:
    """Return the tetrahedra of the solids of a B-rep, a text in the BREP format. Raises MesherError."""
    with tempfile.TemporaryDirectory() as folder:
        source, target, places = Path(folder, "part.brep"), Path(folder, "mesh.npz"), Path(folder, "places")
        source.write_bytes(text)
        rows = "\n".join(" ".join(map(repr, row)) for row in sizes.places.tolist())
        places.write_text(f"{len(sizes.places)}\n{rows}\n0\n")
        options = {"largest": sizes.largest, "around": sizes.around, "growth": sizes.growth, "places": str(places)}
        run_netgen([str(PROGRAM), str(source), str(target), json.dumps(options)])
        if not target.exists():
            raise MesherError("Netgen ended without tetrahedra")
        with np.load(target) as arrays:
            found = dict(arrays)
    gaps = found.pop("gaps")
    mesh = TetrahedralMesh(**found).with_gaps(gaps)
    if not len(mesh.cells) or mesh.volumes.min() <= 0.0:
        raise MesherError("Netgen made flat tetrahedra")
    return mesh


def run_netgen(command: list[str]) -> None:
    """Run a program that imports Netgen. Raises MesherError where it fails, or takes too long."""
    try:
        ended = subprocess.run(
            [sys.executable, "-P", *command],
            capture_output=True,
            timeout=PATIENCE,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        raise MesherError(f"Netgen takes more than {PATIENCE:.0f} s") from None
    if ended.returncode:
        said = ended.stderr.decode(errors="replace").strip().splitlines()
        raise MesherError(f"Netgen fails ({''.join(said[-1:])[:120] or f'it ended with {ended.returncode}'})")
