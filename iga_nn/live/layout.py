"""The live page's parts, as trame's widgets; what is in double braces or a tuple is evaluated in the browser.

State: `jobs`, rows of state.row; `current`, the job a new tab shows; `shown`, the one this tab's user chose; for
each job `points_N`, `polys_N` and `colors_N` for vtk.js (get(name) gives Vue's reference to a state, hence `.value`).
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from trame.ui.html import DivLayout
from trame.widgets import client, html, vtk

from ..samples import SAMPLES
from .state import MEGABYTE


def lay_out(server: Any, limit: int) -> None:
    """The whole page; limit: bytes an upload may have."""
    here = files(__package__)
    sheets = (files("iga_nn.report") / "page.css", here / "app.css")
    css = "".join(sheet.read_text(encoding="utf-8") for sheet in sheets)
    with DivLayout(server):
        client.Style(css)
        client.Script((here / "app.js").read_text(encoding="utf-8"))
        html.H1("iga-nn")
        html.P(
            "Turns a closed surface into a solid spline volume, proves that it has no folds, and solves Poisson's "
            "equation on it. Give it a surface, press Start, watch it turn into a cube; then look at the result and "
            "keep its files. Nothing leaves this computer.",
            classes="soft",
        )
        with html.Section(classes=("{drop: true, compact: jobs.length > 0}",)):
            html.Strong("Drop a surface file here")
            html.Span(" or ")
            html.Input(type="file", id="file", raw_attrs=[f'data-limit="{limit}"'])
            html.Label("choose one", raw_attrs=['for="file"'], classes="button small")
            html.P(
                f"OBJ, STL, PLY, OFF, or tetrahedra as MESH, MSH, VTU; closed, without handles; at most "
                f"{limit // MEGABYTE} MB.",
                classes="soft formats",
            )
            with html.Div("No file at hand? Take a sample: ", classes="soft samples"):
                for name in SAMPLES:
                    html.Button(name, classes="button small", click=f"window.post('sample/{name}')")
        with (
            html.Ul(classes="list", v_if="jobs.length > 1"),
            html.Li(v_for="job in jobs", key="job.number"),
            html.Button(click="shown = job.number", classes=("{shown: job.number === (shown || current)}",)),
        ):
            html.Span("{{ job.name }}")
            html.Small("{{ job.label }}")
        with html.Section(v_for="job in jobs.filter((one) => one.number === (shown || current))", key="job.number"):
            _lay_out_job()


def _lay_out_job() -> None:
    """The job that is shown: the gate's verdict, the training, the results."""
    html.H2("{{ job.name }}", v_if="job.state !== 'done'")  # the report starts with it
    html.P("Being checked ...", v_if="job.state === 'checking'", classes="soft")
    with html.Div(v_if="job.state === 'refused'", classes="verdict bad"):
        html.Strong("Refused")
        html.Span("{{ job.text }}")
    with html.Div(v_if="job.size && job.state !== 'done'", classes="verdict good"):
        html.Strong("Accepted")
        html.Span("{{ job.size }}")
        with html.Ul(v_if="job.notices.length"):
            html.Li("{{ notice }}", v_for="notice in job.notices")
    with html.Div(v_if="job.state === 'failed'", classes="verdict bad"):
        html.Strong("Failed")
        html.Span("{{ job.text }}")
    with html.Div(v_if="job.state === 'stopped'", classes="verdict unsure"):
        html.Strong("Stopped")
        html.Span("{{ job.resumable ? 'Resume continues where it was stopped.' : 'Resume starts it anew.' }}")
    _lay_out_actions()
    with html.Div(v_if="job.size && job.state !== 'done'", classes=("{watch: job.mapped}",)):
        _lay_out_drawing()
        _lay_out_progress()
    with html.Details(v_if="job.files.length", open=("job.state !== 'done'",)):
        html.Summary("Download the files ({{ job.files.length }})")
        html.P("They are deleted when the page's program ends: keep what you need.", classes="soft")
        with html.Table(classes="files"), html.Tr(v_for="file in job.files", key="file.name"):
            with html.Td():
                html.A("{{ file.name }}", href=("`files/${job.number}/${file.name}`",), download=("file.name",))
            html.Td("{{ file.size }}")
            html.Td("{{ file.holds }}")
    html.Iframe(
        v_if="job.state === 'done'",
        src=("`files/${job.number}/report.html`",),
        title="The report",
        raw_attrs=['@load="window.fit($event.target)"'],
    )


def _lay_out_actions() -> None:
    with html.Div(classes="actions"):
        html.Button(
            "Start", v_if="job.state === 'ready'", classes="button first", click="trigger('start', [job.number])"
        )
        html.Span("takes some minutes", v_if="job.state === 'ready'", classes="soft")
        html.Button(
            "Resume", v_if="job.state === 'stopped'", classes="button first", click="trigger('start', [job.number])"
        )
        html.Span("{{ job.label }}; one job runs at a time", v_if="job.state === 'waiting'")
        html.Button(
            "{{ job.state === 'waiting' ? 'Remove' : 'Stop' }}",
            v_if="['waiting', 'running'].includes(job.state)",
            disabled=("job.stopping",),
            classes="button",
            click="trigger('stop', [job.number])",
        )
        html.Span("Stopping ...", v_if="job.stopping", classes="soft")
        html.Span("Starting ...", v_if="job.state === 'running' && !job.facts", classes="soft")


def _lay_out_drawing() -> None:
    with html.Div(v_if="get('points_' + job.number)?.value", key="job.mapped"):
        with (
            html.Div(classes="drawing"),
            vtk.VtkView(background=("[1, 1, 1]",)),
            vtk.VtkGeometryRepresentation(
                mapper=("{colorMode: 2}",),  # the values are the colours
                property=("{edgeVisibility: job.edges, edgeColor: [0.35, 0.4, 0.45], ambient: 0.25, diffuse: 0.8}",),
            ),
            vtk.VtkPolyData(
                "surface", points=("get('points_' + job.number)?.value",), polys=("get('polys_' + job.number)?.value",)
            ),
            vtk.VtkCellData(),
        ):
            vtk.VtkDataArray(
                registration="setScalars",
                type="Uint8Array",
                values=("get('colors_' + job.number)?.value",),
                raw_attrs=[':number-of-components="3"'],  # trame_vtk misspells the name
            )
        html.P(
            "{{ job.mapped ? 'Where the training takes the surface: each colour is one face of the cube.' : "
            "'The surface.' }} Drag to turn it.",
            classes="soft",
        )


def _lay_out_progress() -> None:
    with html.Div(v_if="job.facts"):
        with html.Dl(classes="facts"), html.Div(v_for="fact in job.facts", key="fact[0]"):
            html.Dt("{{ fact[0] }}")
            html.Dd("{{ fact[1] }}")
            html.Small("{{ fact[2] }}")
        html.Progress(value=("job.share",), max="1")
        html.P("The loss so far, logarithmic; each stage weighs it anew", v_if="job.curve", classes="soft")
        html.Div(
            v_if="job.curve",
            v_html="`<svg class='curve' viewBox='0 0 100 100' preserveAspectRatio='none'>"
            "<polyline points='${job.curve}'/></svg>`",
        )
        html.P("Last message: {{ job.line }}", v_if="job.line", classes="soft")
