"""Finds what draws and converts results: code of the package `iga_nn`, which stands above, by its name.

`volume.plot()` belongs to the volume, but figures, tables and files of other programs to `iga_nn`, which imports the
volume. So this one module looks upwards, and only when such a method is called: importing the package loads none of it.
"""

from importlib import import_module
from typing import Any


def above(module: str) -> Any:
    """Return a module of `iga_nn`, such as "io.vtk"."""
    return import_module(f"iga_nn.{module}")


class Shown:
    """A result that notebooks show as a table."""

    def _repr_html_(self) -> str:
        """Return the table as HTML."""
        return str(above("report.notebook").as_html(self))
