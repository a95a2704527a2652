"""The scripts of `examples` as modules, and what they leave: pictures and tables."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
from matplotlib.image import imread

import iga_nn
from iga_nn.figures.render import can_draw

EXAMPLES = Path(iga_nn.__file__).resolve().parents[1] / "examples"


def load(name: str) -> ModuleType:
    return load_file(EXAMPLES / f"{name}.py")


def load_file(file: Path) -> ModuleType:
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))  # as it is for a script: its neighbours can be imported
    spec = importlib.util.spec_from_file_location(f"example_{file.stem}", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def shown(picture: Path) -> bool:
    """Whether the example drew something in colours, or nothing can be drawn here."""
    if not can_draw():
        return not picture.exists()
    image = imread(picture)[..., :3]
    return np.mean(image.max(axis=-1) - image.min(axis=-1) > 0.1) > 0.01


def cells(text, model):
    """The model's rows in the tables of a Markdown text."""
    rows = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:1] == "|"]
    return [row for row in rows if row[0] == model]
