"""A figure of matplotlib that notebooks show without its window machinery."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

DPI = 72  # in a notebook, where a figure is as wide as the text


class Picture(Figure):
    """A figure outside pyplot, which need not be closed; a notebook shows it as the last value of a cell."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DPI)
        return stream.getvalue()
