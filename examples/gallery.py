"""Run the gallery and keep its pictures, small: `python examples/gallery.py [--full] [NAME ...]`.

Writes into examples/pictures what examples/README.md shows. Trainings are shortened, unless --full is given.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable
from pathlib import Path

from PIL import Image

import iga_nn

HERE = Path(__file__).resolve().parent
WIDTH, COLORS = 640, 224  # of a picture kept
EQUATIONS = (
    "own_law",
    "heat",
    "vibration",
    "thermal_stress",
    "convection_diffusion",
    "nonlinear_conductivity",
    "large_strain",
)
SHORT = {"steps_factor": 0.06, "control_points": 12}


def runs(full: bool) -> dict[str, Callable[[], Path]]:
    """The examples by name; each returns its picture."""
    sys.path.insert(0, str(HERE))
    mapping = iga_nn.MapOptions() if full else iga_nn.MapOptions(**SHORT)
    module = importlib.import_module
    equations = {name: lambda name=name: module(name).main() for name in EQUATIONS}
    return {
        "first_run": lambda: module("first_run").main(config=mapping.config()),
        "own_mesh": lambda: module("own_mesh").main(mapping=mapping),
        "given_corners": lambda: module("given_corners").main(config=mapping.config()),
        "boundary_conditions": lambda: module("boundary_conditions").main(),
        "convergence": lambda: convergence(full),
        "compare": lambda: module("compare").main(),
        "load_volume": lambda: module("load_volume").main(),
        "export_files": lambda: module("export_files").main(),
        "elasticity": lambda: module("elasticity").main(),
        "rational_ring": lambda: module("rational_ring").main(),
        "l_shape": lambda: module("l_shape").main(),
        "graded_spans": lambda: module("graded_spans").main(),
        "plate_with_hole": lambda: module("plate_with_hole").main(),
        "pulled_ring": lambda: module("pulled_ring").main(),
        "bracket": lambda: module("bracket").main(),
        "cad_part": lambda: module("cad_part").main(),
        "batch": lambda: module("batch").main(mapping=mapping),
        **equations,
    }


def convergence(full: bool) -> Path:
    """The example writes four files; the picture is one of them."""
    importlib.import_module("convergence").main([] if full else ["--levels", "3", "--degrees", "2", "3", "4"])
    return Path("out/convergence/convergence.png")


def keep(picture: Path, target: Path) -> None:
    """A smaller picture with few colours: some 30 kB."""
    with Image.open(picture) as image:
        image = image.convert("RGB")
        small = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
        small.quantize(COLORS, dither=Image.Dither.NONE).save(target, optimize=True)


def main(argv: list[str] | None = None) -> None:
    """Run what is named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--full", action="store_true")
    options = parser.parse_args(argv)
    for name, run in runs(options.full).items():
        if not options.names or name in options.names:
            keep(run(), HERE / "pictures" / f"{name}.png")
            print(HERE / "pictures" / f"{name}.png")


if __name__ == "__main__":
    main()
