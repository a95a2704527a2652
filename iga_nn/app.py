"""The live page: trame serves it to this computer's browser alone; surfaces come in, jobs run, files go out.

The state all open tabs share is the list of jobs; which job a tab shows is its own affair. Pictures are drawn by the
browser, so that the server needs no graphics library.
"""

from __future__ import annotations

import asyncio
import base64
import math
import webbrowser
from collections.abc import Awaitable, Callable
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from parameterize.bspline import Array

from . import job_process
from .data import resolve
from .folder import has_checkpoint
from .jobs import Job, Jobs
from .options import InputError, MapOptions, PoissonOptions, input_errors
from .samples import SAMPLES, sample, write_obj
from .sampling import FACE_COLORS

if TYPE_CHECKING:
    from aiohttp import web

INSTALL = "pip install 'iga-nn[app]'"
HOST = "127.0.0.1"  # the page is for this computer's user: there is no option for another one
MEGABYTE = 1 << 20
POLICY = (  # the browser itself refuses to fetch anything from elsewhere; Vue compiles templates, hence unsafe-eval
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' ws: data: blob:"
)
STAGES = {
    "S(2)": "1 of 6: to a round shape",
    "S(1)": "2 of 6: to a rounded cube",
    "cube": "3 of 6: to a cube",
    "corners": "4 of 6: corners fixed",
    "edges": "5 of 6: edges fixed",
    "spline": "6 of 6: the spline itself",
}
LABELS = {
    "checking": "being checked",
    "refused": "refused",
    "ready": "accepted",
    "waiting": "waiting",
    "running": "running",
    "done": "done",
    "failed": "failed",
    "stopped": "stopped",
}
CONTENT = {  # of the files, those a user wants first in front
    "volume.npz": "the spline volume",
    "solution.npz": "the solution of Poisson's equation on it",
    "boundary.npz": "the map from the surface to the cube",
    "report.html": "this report, to keep",
    "report.json": "the report for programs",
    "history.npz": "loss of every training step",
    "faces.png": "the cube's faces in colours",
    "distortion.png": "distortion on three sections",
    "error.png": "error on three sections",
    "history.png": "loss over the steps",
}
VIEW = np.array([[0.77, 0.0, -0.64], [-0.27, 0.91, -0.32], [0.58, 0.42, 0.70]])  # rows: right, up, to the viewer
EDGES_UP_TO = 6_000  # faces whose edges are drawn, too


def serve(
    say: Callable[[str], None],
    port: int,
    open_browser: bool,
    max_upload: int,
    mapping: MapOptions,
    poisson: PoissonOptions,
) -> None:
    """Serve the page until interrupted; max_upload in megabytes; the address is told to `say`.

    Raises InputError for options that cannot be run, without trame, and where the port is taken.
    """
    mapping.config()
    poisson.problem()
    if mapping.resume or mapping.corners:
        raise InputError("resume and corners belong to one surface: leave them out here")
    if not 0 <= port <= 65_535:
        raise InputError(f"port {port}: must lie between 0, for any free one, and 65535")
    if max_upload < 1:
        raise InputError(f"max upload {max_upload}: must be at least 1 megabyte")
    try:
        from trame.app import get_server
    except ImportError:
        raise InputError(f"the live page needs trame, which is not installed: {INSTALL}") from None
    with TemporaryDirectory(prefix="iga-nn-") as root:
        page = _Page(get_server("iga-nn", client_type="vue3"), Path(root), max_upload * MEGABYTE, mapping, poisson)
        with input_errors():
            page.run(say, port, open_browser)


class _Page:
    """One running page: its trame server, its routes, its jobs."""

    def __init__(self, server: Any, root: Path, limit: int, mapping: MapOptions, poisson: PoissonOptions) -> None:
        self._server, self._limit, self._mapping, self._poisson = server, limit, mapping, poisson
        self._loop: asyncio.AbstractEventLoop | None = None
        self._drawn: dict[int, Array] = {}  # points last sent, by job
        self.jobs = Jobs(root, self._check, self._run, self._tell)

    def run(self, say: Callable[[str], None], port: int, open_browser: bool) -> None:
        """Serve until interrupted."""
        server = self._server
        server.state.update({"jobs": [], "current": 0, "shown": 0, "trame__title": "iga-nn"})
        server.state.client_only("shown")
        for name, act in {"start": self.jobs.start, "stop": self.jobs.stop}.items():
            server.trigger(name)(self._on_job(act))
        _lay_out(server, self._limit)
        server.controller.on_server_bind.add(self._bind)

        def ready(**_: Any) -> None:
            self._loop = asyncio.get_running_loop()
            address = f"http://{HOST}:{server.port}/"
            say(f"{address}\nopen this address in a browser; Ctrl-C ends the page and deletes its files")
            if open_browser:
                webbrowser.open(address)

        server.controller.on_server_ready.add(ready)
        try:
            server.start(port=port, host=HOST, open_browser=False, show_connection_info=False, timeout=0)
        finally:
            self._loop = None
            self.jobs.close()

    # Jobs

    def _check(self, path: Path) -> Any:
        return resolve(str(path), component=self._mapping.component, max_faces=self._mapping.max_faces)

    def _run(self, job: Job) -> Any:
        from dataclasses import replace

        mapping = replace(self._mapping, resume=has_checkpoint(job.results))
        return job_process.run(job.folder, job.name, mapping, self._poisson, job.stop)

    def _on_job(self, act: Callable[[Job], None]) -> Callable[[int], None]:
        def on_number(number: int) -> None:
            if job := self.jobs.find(number):
                act(job)

        return on_number

    def _tell(self, job: Job) -> None:
        """From any thread: show the change in every tab."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._show, job)

    def _show(self, changed: Job) -> None:
        with self._server.state as state:
            jobs = list(self.jobs)
            state.jobs = [_row(job, self.jobs.before(job)) for job in jobs]
            state.current = next((job.number for job in jobs if job.state == "running"), jobs[-1].number)
            self._draw(state, changed)

    def _draw(self, state: Any, job: Job) -> None:
        """Send the surface, and where the training takes it, when there is something new."""
        if job.surface is None:
            return
        points = job.surface.unit_vertices if job.mapped is None else job.mapped
        if self._drawn.get(job.number) is points:
            return
        if job.number not in self._drawn:
            state[f"polys_{job.number}"] = _packed(_polygons(job.surface.faces))
        self._drawn[job.number] = points
        state[f"colors_{job.number}"] = _packed(_colors(points, job.surface.faces, mapped=job.mapped is not None))
        state[f"points_{job.number}"] = _packed((points @ VIEW.T).astype(np.float32))

    # Routes

    def _bind(self, served: Any) -> None:
        """Add our routes and guards to the web server before it listens."""
        from aiohttp import web

        served.config["host"] = HOST  # whatever trame's own variables and arguments say
        app: web.Application = served.app
        app.middlewares.append(_guard(lambda: self._server.port))
        app.on_response_prepare.append(_restrict)
        app.add_routes(
            [
                web.post("/upload", self._upload),
                web.post("/sample/{name}", self._sample),
                web.post("/paraview/", self._session),
                web.get("/files/{number}/{name}", self._file),
            ]
        )

    async def _session(self, request: web.Request) -> Any:
        """Where trame's client asks for the address of its web socket."""
        from aiohttp import web

        return web.json_response({"sessionURL": f"ws://{request.host}/ws"})

    async def _upload(self, request: web.Request) -> Any:
        """Take a file as the body; the answer is the job's number, refused or not."""
        from aiohttp import web

        job = self.jobs.add(request.query.get("name", ""))
        size = max(int(request.query.get("size", "0")), request.content_length or 0)
        if size <= self._limit:
            size = 0
            with job.path.open("wb") as stream:
                async for part in request.content.iter_chunked(MEGABYTE):
                    size += len(part)
                    if size > self._limit:
                        break
                    stream.write(part)
        if size > self._limit:
            job.path.unlink(missing_ok=True)
            limit = self._limit // MEGABYTE
            self.jobs.refuse(job, f"{job.name}: more than {limit} MB: make it smaller, or raise --max-upload")
        else:
            self.jobs.check(job)
        return web.Response(text=str(job.number))

    async def _sample(self, request: web.Request) -> Any:
        from aiohttp import web

        name = request.match_info["name"]
        if name not in SAMPLES:
            raise web.HTTPNotFound
        job = self.jobs.add(f"{name}.obj")
        await asyncio.to_thread(lambda: write_obj(sample(name), job.path))
        self.jobs.check(job)
        return web.Response(text=str(job.number))

    async def _file(self, request: web.Request) -> Any:
        """A result of a job; nothing but the names in CONTENT."""
        from aiohttp import web

        number, name = request.match_info["number"], request.match_info["name"]
        job = self.jobs.find(int(number)) if number.isdecimal() else None
        if job is None or name not in CONTENT or not (job.results / name).is_file():
            raise web.HTTPNotFound
        return web.FileResponse(job.results / name, headers={"Cache-Control": "no-store"})


def _guard(port: Callable[[], int]) -> Any:
    """Answer this page alone: another site's page may reach this port through the user's browser."""
    from aiohttp import web

    @web.middleware
    async def guard(request: web.Request, handler: Callable[[web.Request], Awaitable[Any]]) -> Any:
        own = {f"{name}:{port()}" for name in (HOST, "localhost")}
        origin = request.headers.get("Origin")
        if request.host not in own or (origin is not None and origin.removeprefix("http://") not in own):
            raise web.HTTPForbidden(text=f"this page answers at http://{HOST}:{port()}/ only")
        return await handler(request)

    return guard


async def _restrict(_: web.Request, response: Any) -> None:
    response.headers["Content-Security-Policy"] = POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"


def _row(job: Job, before: int) -> dict[str, Any]:
    """What the page says of a job, in JSON's own types."""
    row: dict[str, Any] = {
        "number": job.number,
        "name": job.name,
        "state": job.state,
        "label": LABELS[job.state] + (f", {before} before it" if before else ""),
        "text": job.text,
        "line": job.log[-1] if job.log else "",
        "resumable": has_checkpoint(job.results),
        "mapped": job.mapped is not None,
        "files": _files(job) if job.state in ("done", "failed", "stopped") else [],
    }
    if job.surface is not None:
        vertices, faces = len(job.surface.vertices), len(job.surface.faces)
        row["size"] = f"{vertices:,} vertices, {faces:,} faces"
        row["edges"] = faces <= EDGES_UP_TO
        row["notices"] = list(job.surface.notices)
    if job.progress is not None:
        now = job.progress
        minutes, seconds = divmod(round(max(0.0, now.seconds_left)), 60)
        row["facts"] = [
            ["Stage", STAGES.get(now.stage, now.stage), f"step {now.step} of {now.steps}"],
            ["Time left", f"{minutes}:{seconds:02d}", "of the spline, at most" if now.stage == "spline" else "of the training"],
            ["Loss", f"{now.loss:.2e}", "what the training lowers"],
            ["Folded samples", f"{now.folded:,}", "0 is wanted"],
        ]
        row["share"] = now.step / max(now.steps, 1)
        row["curve"] = _curve(job.losses)
    return row


def _files(job: Job) -> list[dict[str, Any]]:
    """The results there are, with what they hold."""
    found = [(name, job.results / name) for name in CONTENT if (job.results / name).is_file()]
    return [{"name": name, "size": _size(path.stat().st_size), "holds": CONTENT[name]} for name, path in found]


def _size(count: int) -> str:
    return f"{count / MEGABYTE:.1f} MB" if count >= MEGABYTE else f"{max(1, round(count / 1024))} kB"


def _curve(losses: list[float]) -> str:
    """Points of a polyline in a box of 100 x 100: the logarithm of the loss over the steps told."""
    logs = np.log10(np.maximum(losses, 1e-300))
    if len(logs) < 2 or not math.isfinite(float(np.ptp(logs))):
        return ""
    x = np.linspace(0.0, 100.0, len(logs))
    y = 95.0 - 90.0 * (logs - logs.min()) / (np.ptp(logs) or 1.0)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _polygons(faces: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Triangles (m, 3) as VTK lists cells: the number of corners before each."""
    return np.insert(faces, 0, 3, axis=1).astype(np.uint32)


def _colors(points: Array, faces: NDArray[np.int64], *, mapped: bool) -> NDArray[np.uint8]:
    """Red, green, blue (m, 3) of the triangles: of the cube's face each is nearest to; grey before the training."""
    if not mapped:
        return np.full(faces.shape, 190, dtype=np.uint8)
    away = points[faces].mean(axis=1) - 0.5  # from the cube's centre
    axis = np.abs(away).argmax(axis=1)
    side = np.take_along_axis(away, axis[:, None], axis=1)[:, 0] > 0.0
    palette = np.array([[int(color[at : at + 2], 16) for at in (1, 3, 5)] for color in FACE_COLORS], dtype=np.uint8)
    return palette[2 * axis + side]


def _packed(values: NDArray[Any]) -> dict[str, str]:
    """An array as vtk.js takes it."""
    return {"bvals": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii"), "dtype": values.dtype.name}


def _lay_out(server: Any, limit: int) -> None:
    """The page's parts; what is in double braces or starts with v_ is evaluated in the browser."""
    from trame.ui.html import DivLayout
    from trame.widgets import client, html

    here = files(__package__)
    css = "".join((here / name).read_text(encoding="utf-8") for name in ("page.css", "app.css"))
    with DivLayout(server):
        client.Style(css)
        client.Script((here / "app.js").read_text(encoding="utf-8"))
        html.H1("iga-nn")
        html.P(
            "Turns a closed surface into a solid spline volume, proves that it has no folds, and solves an equation "
            "on it. All of this happens on your own computer.",
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
        with html.Ul(classes="list", v_if="jobs.length > 1"):
            with html.Li(v_for="job in jobs", key="job.number"):
                with html.Button(click="shown = job.number", classes=("{shown: job.number === (shown || current)}",)):
                    html.Span("{{ job.name }}")
                    html.Small("{{ job.label }}")
        with html.Section(v_for="job in jobs.filter((one) => one.number === (shown || current))", key="job.number"):
            _lay_out_job()


def _lay_out_job() -> None:
    """The job that is shown: the gate's verdict, the training, the results."""
    from trame.widgets import html

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
        html.Span("{{ job.resumable ? 'It can go on from where it was stopped.' : 'It can be started anew.' }}")
    _lay_out_actions()
    with html.Div(v_if="job.size && job.state !== 'done'", classes=("{watch: job.mapped}",)):
        _lay_out_drawing()
        _lay_out_progress()
    with html.Template(v_if="job.state === 'done'"):
        html.Iframe(
            src=("`files/${job.number}/report.html`",),
            title="The report",
            raw_attrs=['@load="window.fit($event.target)"'],
        )
    with html.Div(v_if="job.files.length"):
        html.H2("Files")
        html.P("They are deleted when the page's program ends: download what you want to keep.", classes="soft")
        with html.Table(classes="files"), html.Tr(v_for="file in job.files", key="file.name"):
            with html.Td():
                html.A("{{ file.name }}", href=("`files/${job.number}/${file.name}`",), download=("file.name",))
            html.Td("{{ file.size }}")
            html.Td("{{ file.holds }}")


def _lay_out_actions() -> None:
    from trame.widgets import html

    with html.Div(classes="actions"):
        html.Button(
            "Start", v_if="job.state === 'ready'", classes="button first", click="trigger('start', [job.number])"
        )
        html.Span("takes some minutes", v_if="job.state === 'ready'", classes="soft")
        html.Button(
            "Go on", v_if="job.state === 'stopped'", classes="button first", click="trigger('start', [job.number])"
        )
        html.Span("{{ job.label }}; one job runs at a time", v_if="job.state === 'waiting'")
        html.Button(
            "{{ job.state === 'waiting' ? 'Take out of the queue' : 'Stop' }}",
            v_if="['waiting', 'running'].includes(job.state)",
            classes="button",
            click="trigger('stop', [job.number])",
        )


def _lay_out_drawing() -> None:
    from trame.widgets import html, vtk

    with html.Div(v_if="get('points_' + job.number)?.value", key="job.mapped"):
        with (
            html.Div(classes="drawing"),
            vtk.VtkView(background=("[1, 1, 1]",)),
            vtk.VtkGeometryRepresentation(
                mapper=("{colorMode: 2}",),  # the values are the colours
                property=("{edgeVisibility: job.edges, edgeColor: [0.35, 0.4, 0.45], ambient: 0.25, diffuse: 0.8}",)
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
    from trame.widgets import html

    with html.Div(v_if="job.facts"):
        with html.Dl(classes="facts"), html.Div(v_for="fact in job.facts", key="fact[0]"):
            html.Dt("{{ fact[0] }}")
            html.Dd("{{ fact[1] }}")
            html.Small("{{ fact[2] }}")
        html.Progress(value=("job.share",), max="1")
        html.P("Loss of the training, logarithmic", v_if="job.curve", classes="soft")
        html.Div(
            v_if="job.curve",
            v_html="`<svg class='curve' viewBox='0 0 100 100' preserveAspectRatio='none'><polyline points='${job.curve}'/></svg>`",
        )
        html.P("Last message: {{ job.line }}", v_if="job.line", classes="soft")
