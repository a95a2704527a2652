"""Serves the live page through trame to this computer's browser alone: takes surfaces, runs jobs, gives out files.

All open tabs share the list of jobs, which is gone when the server ends. Each tab keeps for itself which job it shows
and the content of its forms, also when it is loaded again. The browser draws the pictures, so the server
needs no graphics library for them.
"""

import asyncio
import json
import logging
import re
import secrets
import webbrowser
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from aiohttp import ClientError, http_exceptions, web
from trame.app import get_server
from trame.ui.html import DivLayout
from trame.widgets import client, vtk

from parameterize.arrays import Array, IntArray
from parameterize.surface.surface import Surface

from ..errors import InputError, one_line
from ..models import resolve
from ..options import MapOptions, ProblemOptions
from ..samples import SAMPLES, sample, write_obj
from ..workflow.output_folder import has_checkpoint
from . import page_form
from . import worker as job_process
from .page_content import CONTENT, MEGABYTE, as_placed, colors, is_ahead, is_solvable, places, row, triangles
from .picking import picked
from .queue import Job, Jobs
from .worker import Message

HOST = "127.0.0.1"  # the page is for this computer's user: there is no option for another one
POLICY = (  # the browser itself refuses to fetch anything from elsewhere; Vue compiles templates, hence unsafe-eval
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    f"connect-src 'self' ws://{HOST}:* ws://localhost:* data: blob:; frame-ancestors 'self'"
)

TICK = 1.0  # seconds between two updates of a running job
NUMBER = "{number:[1-9][0-9]{0,8}}"  # of a job, in a route: digits of ASCII
FARTHEST = 1e6  # of a point on a line of sight from the part, whose volume is 1
LONGEST = 255  # bytes of a path that is asked for
ARRAYS = ("polys", "colors", "points")  # of a job, that vtk.js draws
ENDED = "trame_error_report_msg"  # trame's client sets it when the connection is lost

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Page:
    """Serve one page: its trame server, its routes, its jobs. max_upload: megabytes a file may have."""

    def __init__(self, root: Path, max_upload: int, mapping: MapOptions, problem_options: ProblemOptions) -> None:
        self._server: Any = get_server("iga-nn", client_type="vue3")
        self._limit, self._mapping, self._problem_options = max_upload * MEGABYTE, mapping, problem_options
        self._loop: asyncio.AbstractEventLoop | None = None
        self._drawn: dict[int, tuple[Array, IntArray | None]] = {}  # points and the face picked last sent, by job
        self.jobs = Jobs(root, self._check, self._run, self._tell)
        logging.getLogger("aiohttp.server").addFilter(_not_the_clients)

    def run(self, say: Callable[[str], None], port: int, open_browser: bool) -> None:
        """Serve until interrupted; `say` receives the address."""
        server = self._server
        server.state.update({"jobs": [], "current": 0, "latest": 0, "trame__title": "iga-nn"})
        own = {"shown": 0, "paper": None, "webgl": True, "asked": 0, "picked": None, ENDED: ""}
        server.state.update({"page": secrets.token_hex(8), **own})
        server.state.update({"limit": self._limit // MEGABYTE, "samples": list(SAMPLES)})
        server.state.update(page_form.described())
        server.state.client_only(*own)
        for name, act in {"stop": self.jobs.stop, "delete": self.jobs.delete}.items():
            server.trigger(name)(partial(self._act, act))
        self._lay_out()
        server.controller.on_server_bind.add(self._bind)

        def ready(**_: Any) -> None:
            self._loop = asyncio.get_running_loop()
            self._loop.call_later(TICK, self._tick)
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

    def _lay_out(self) -> None:
        """Set the page's template, style and script in trame."""
        here = files(__package__)
        sheets = (files("iga_nn.report") / "page.css", here / "app.css")
        vtk.initialize(self._server)  # its elements stand in the template, where trame does not see them
        with DivLayout(self._server) as layout:
            client.Style("".join(sheet.read_text(encoding="utf-8") for sheet in sheets))
            client.Script((here / "app.js").read_text(encoding="utf-8"))
            layout.root.add_child((here / "app.html").read_text(encoding="utf-8"))
        # The template that trame's client shows when the server has ended: the page itself, so that it stays.
        self._server.state["trame__template_error"] = layout.html

    # Jobs

    def _check(self, path: Path) -> Surface:
        surface, notice = resolve(str(path), **self._mapping.reading()).fitted  # what the browser draws, too
        return replace(surface, notices=(*surface.notices, *filter(None, [notice])))

    def _run(self, job: Job) -> Iterator[Message]:
        mapping = None if job.problem_options else replace(self._mapping, resume=has_checkpoint(job.results))
        return job_process.run(
            job.folder, job.name, mapping, job.problem_options or job.wanted or self._problem_options, job.stop
        )

    def _act(self, act: Callable[[Job], None], number: int) -> None:
        if job := self.jobs.find(number):
            act(job)

    def _tell(self, job: Job) -> None:
        """Show a change in every tab; may be called from any thread."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._show, job)

    def _tick(self) -> None:
        """Update the rows of running jobs, once every TICK seconds."""
        if self._loop is None:
            return
        self._loop.call_later(TICK, self._tick)
        for job in self.jobs:
            if job.state == "running":
                self._show(job)

    def _show(self, changed: Job) -> None:
        with self._server.state as state:
            jobs = list(self.jobs)
            state.jobs = [row(job, self.jobs.before(job), self._problem_options) for job in jobs]
            state.latest = self.jobs.latest
            running = [job.number for job in jobs if job.state == "running"]
            state.current = max(running or [job.number for job in jobs], default=0)
            if changed in jobs:
                self._draw(state, changed)
            elif self._drawn.pop(changed.number, None) is not None:
                state.update({f"{name}_{changed.number}": None for name in ARRAYS})

    def _draw(self, state: Any, job: Job) -> None:
        """Send the surface, or its image under the training's map, where it has changed."""
        if job.surface is None:
            return
        points = job.surface.unit_vertices if job.mapped is None else job.mapped
        drawn, face = self._drawn.get(job.number, (None, None))
        if drawn is points and face is job.picked:
            return
        if drawn is None:
            state[f"polys_{job.number}"] = triangles(job.surface)
        self._drawn[job.number] = points, job.picked
        mapped = job.mapped is not None
        state[f"colors_{job.number}"] = colors(points, job.surface, mapped=mapped, picked=job.picked)
        if drawn is not points:
            state[f"points_{job.number}"] = places(points)

    # Routes

    def _bind(self, served: Any) -> None:
        """Add the routes and guards to the web server before it listens."""
        served.config["host"] = HOST  # trame's own variables and arguments could say otherwise
        app: web.Application = served.app
        app.middlewares.append(_guard(lambda: self._server.port))
        app.on_response_prepare.append(_restrict)
        app.add_routes(
            [
                web.post("/upload", self._upload),
                web.post("/sample/{name}", self._sample),
                web.post(f"/face/{NUMBER}", self._face),
                web.post(f"/start/{NUMBER}", self._start),
                web.post(f"/solve/{NUMBER}", self._solve),
                web.post("/paraview/", self._session),
                web.get(f"/files/{NUMBER}/{{name}}", self._file),
            ]
        )

    async def _session(self, request: web.Request) -> web.Response:
        """Tell trame's client the address of its web socket."""
        return web.json_response({"sessionURL": f"ws://{request.host}/ws"})

    async def _upload(self, request: web.Request) -> web.Response:
        """Take a file as the body and answer with the number of its job, whether it is refused or not."""
        job = self.jobs.add(request.query.get("name", ""))
        announced = request.query.get("size", "")
        size = int(announced) if re.fullmatch("[0-9]{1,15}", announced) else 0
        try:
            if size <= self._limit:
                came = await self._keep(request, job.path)
                if came < size:
                    raise OSError(f"{came} of {size} bytes came")
                size = came
        except (OSError, ClientError) as error:
            self.jobs.refuse(job, f"{job.name}: the upload was incomplete ({one_line(error)}): try again")
            return web.Response(text=str(job.number))
        if size > self._limit:
            limit = self._limit // MEGABYTE
            self.jobs.refuse(job, f"{job.name}: larger than {limit} MB: simplify it, or raise --max-upload")
        else:
            self.jobs.check(job)
        return web.Response(text=str(job.number))

    async def _keep(self, request: web.Request, path: Path) -> int:
        """Write the body to a file, up to the limit, and return the number of bytes."""
        size = 0
        with path.open("wb") as stream:
            async for part in request.content.iter_chunked(MEGABYTE):
                size += len(part)
                if size > self._limit:
                    break
                stream.write(part)
        return size

    async def _sample(self, request: web.Request) -> web.Response:
        name = request.match_info["name"]
        if name not in SAMPLES:
            raise web.HTTPNotFound
        job = self.jobs.add(f"{name}.obj")
        await asyncio.to_thread(lambda: write_obj(sample(name), job.path))
        self.jobs.check(job)
        return web.Response(text=str(job.number))

    async def _face(self, request: web.Request) -> web.Response:
        """Take a line of sight, two points as the browser places them; answer with the face of the part it meets.

        The answer has the face's region, its number of triangles and its area; it is null where no face is met.
        """
        job = self._named(request)
        if job is None or job.surface is None or job.mapped is not None:
            raise web.HTTPNotFound(text="this job has no part whose faces could be picked")
        try:
            sight = np.array(json.loads(await request.text()), dtype=np.float64)
        except (ValueError, TypeError, RecursionError):
            sight = np.empty(0)
        if sight.shape != (2, 3) or not np.all(abs(sight) < FARTHEST):
            raise web.HTTPBadRequest(text="a line of sight is two points of three numbers each")
        start, end = job.surface.from_unit(as_placed(sight))
        found = await asyncio.to_thread(picked, job.surface.part, start, end)
        if found is None:
            return web.json_response(None)
        job.picked = found.triangles
        self._tell(job)
        said = {"region": found.region, "triangles": len(found.triangles), "area": float(f"{found.area:.6g}")}
        return web.json_response(said)

    async def _start(self, request: web.Request) -> web.Response:
        """Start a job; the form, where it was shown, has the problem to solve on the volume."""
        job, given = self._named(request), await request.post()
        if job is None:
            raise web.HTTPNotFound
        try:
            if given and is_ahead(job):
                job.wanted = page_form.stated(given, self._problem_options, has_faces=False)
        except InputError as error:
            raise web.HTTPBadRequest(text=one_line(error)) from None
        self.jobs.start(job)
        return web.Response(text=str(job.number))

    async def _solve(self, request: web.Request) -> web.Response:
        """Take the form of a problem, to be solved on a job's volume; answer with the new job's number."""
        job = self._named(request)
        if job is None or not is_solvable(job):
            raise web.HTTPNotFound(text="this job has no volume to solve on")
        try:
            problem_options = page_form.stated(await request.post(), self._problem_options)
        except InputError as error:
            raise web.HTTPBadRequest(text=one_line(error)) from None
        try:
            made = await asyncio.to_thread(self.jobs.solve, job, problem_options)
        except OSError as error:
            raise web.HTTPNotFound(text=f"the volume cannot be copied: {one_line(error)}") from None
        return web.Response(text=str(made.number))

    def _named(self, request: web.Request) -> Job | None:
        return self.jobs.find(int(request.match_info["number"]))

    async def _file(self, request: web.Request) -> web.FileResponse:
        """Send a result of a job; only files named in CONTENT are sent."""
        job, name = self._named(request), request.match_info["name"]
        if job is None or name not in CONTENT or not (job.results / name).is_file():
            raise web.HTTPNotFound
        return web.FileResponse(job.results / name, headers={"Cache-Control": "no-store"})


def _guard(port: Callable[[], int]) -> Any:
    """Return a guard that answers this page alone: a page of another site could ask through the user's browser.

    A browser names the page that asks in `Origin`, but for plain reading. Whatever changes something must name it.
    """

    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        own = {f"{name}:{port()}" for name in (HOST, "localhost")}
        origin = request.headers.get("Origin")
        reads = request.method in ("GET", "HEAD") and request.path != "/ws"
        asks = reads if origin is None else origin in {f"http://{name}" for name in own}
        if request.host not in own or not asks:
            raise web.HTTPForbidden(text=f"this page answers at http://{HOST}:{port()}/ only")
        if len(request.path.encode()) > LONGEST or "\0" in request.path:  # no file can have such a name
            raise web.HTTPNotFound
        # wslink fails on other requests
        if request.path == "/ws" and not web.WebSocketResponse().can_prepare(request):
            raise web.HTTPBadRequest(text="this address takes web sockets only")
        return await handler(request)

    return guard


def _not_the_clients(record: logging.LogRecord) -> bool:
    """Return whether an error is the server's own; a request that is not HTTP is answered with 400 and not logged."""
    return not (record.exc_info and isinstance(record.exc_info[1], http_exceptions.HttpProcessingError))


async def _restrict(_: web.Request, response: web.StreamResponse) -> None:
    response.headers["Content-Security-Policy"] = POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"
