"""Map one part by default settings, save its volume, and print what is known of it as JSON; no report, no pictures.

python examples/benchmarks/map_part.py bracket.step out/bracket
"""

from __future__ import annotations

import json
import sys
import time
from math import prod
from pathlib import Path

import iga_nn
from iga_nn.report import document as reports


def main(argv: list[str]) -> None:
    """Write volume.npz into the folder, and print the figures."""
    step, out = map(Path, argv)
    start = time.perf_counter()
    try:
        result = iga_nn.parameterize(iga_nn.load_surface(step), device="cpu")
    except (iga_nn.MeshError, iga_nn.InputError, ValueError) as error:
        raise SystemExit(f"{type(error).__name__}: {error}") from None
    seconds = time.perf_counter() - start
    out.mkdir(parents=True, exist_ok=True)
    result.volume.save(out / "volume.npz")
    quality = result.quality.as_dict()
    count = quality["control_points"]
    found = {
        "way": result.origin,
        "blocks": len(quality.get("patches", ())) or 1,
        "unknowns": count if isinstance(count, int) else prod(count),
        "seconds": seconds,
        "verdict": quality["bijective"],
        "one_to_one": reports.one_to_one({"parameterization": quality}),
        "volume": quality["volume"]["spline"],
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1:])
