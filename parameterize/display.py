"""Prints results, and finds the code of `iga_nn`, a package above, that draws and converts them, by its name.

`volume.plot()` belongs to the volume, but figures, tables and files of other programs to `iga_nn`, which imports the
volume. So this one module looks upwards, and only when such a method is called: importing the package loads none of it.
"""

from dataclasses import fields
from importlib import import_module
from typing import Any

import numpy as np


def above(module: str) -> Any:
    """Return a module of `iga_nn`, such as "io.vtk"."""
    return import_module(f"iga_nn.{module}")


class Shown:
    """A result that notebooks show as a table."""

    def _repr_html_(self) -> str:
        """Return the table as HTML."""
        return str(above("report.notebook").as_html(self))


class Brief:
    """A dataclass, declared with repr=False, that Python prints in one line: of arrays their shapes alone."""

    def __repr__(self) -> str:
        parts = (f"{field.name}={_brief(getattr(self, field.name))}" for field in fields(self) if field.repr)  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(parts)})"


def _brief(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array{value.shape}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_brief, value))})"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key!r}: {_brief(entry)}' for key, entry in value.items())}}}"
    return repr(value)
