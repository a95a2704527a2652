"""Gives the live page to trame: its template, its style and its script."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from trame.ui.html import DivLayout
from trame.widgets import client, vtk

from ..samples import SAMPLES


def lay_out(server: Any, limit: int) -> None:
    """Lay the page out. limit: megabytes an upload may have."""
    here = files(__package__)
    sheets = (files("iga_nn.report") / "page.css", here / "app.css")
    vtk.initialize(server)  # its elements stand in the template, where trame does not see them
    server.state.update({"limit": limit, "samples": list(SAMPLES)})
    with DivLayout(server) as layout:
        client.Style("".join(sheet.read_text(encoding="utf-8") for sheet in sheets))
        client.Script((here / "app.js").read_text(encoding="utf-8"))
        layout.root.add_child((here / "app.html").read_text(encoding="utf-8"))
