"""Writes a field at some times for ParaView: a .pvd file that names the times, and a .vtu file for each."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from parameterize.files import replacing, save_text
from solve.field import FieldOnBody

from .view import grid
from .vtk import save


def write_series(path: Path, times: Sequence[float], fields: Sequence[FieldOnBody], samples: int | None = None) -> None:
    """Write a field at some times: a .pvd file that names the times, and a .vtu file for each beside it; atomic.

    samples: as in `grid`. Raises ValueError for another ending, and for a field without a volume.
    """
    if path.suffix != ".pvd":
        raise ValueError(f"{path}: a series of ParaView is a file that ends in .pvd")
    entries = []
    for number, (time, field) in enumerate(zip(times, fields, strict=True)):
        target = path.with_name(f"{path.stem}_{number:04d}.vtu")
        with replacing(target) as temporary:
            save(temporary, grid(field.on_body, field, samples=samples))
        entries.append(f'<DataSet timestep="{float(time)!r}" part="0" file="{escape(target.name)}"/>')
    inside = "\n".join(entries)
    save_text(path, f'<VTKFile type="Collection" version="0.1"><Collection>\n{inside}\n</Collection></VTKFile>\n')
