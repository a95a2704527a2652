"""Turns a job into the content of the page: plain values, and arrays for vtk.js."""

import base64
import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from parameterize.arrays import Array, IntArray
from parameterize.cube.cube import nearest_faces
from parameterize.progress import Progress
from parameterize.surface.surface import Surface

from ..figures.colors import FACE_COLORS
from ..options import ProblemOptions
from ..report.artifacts import ARTIFACTS
from ..rounding import clock
from ..workflow.output_folder import has_checkpoint
from . import page_form
from .queue import DELETED, STARTS, Job

MEGABYTE = 1 << 20
STAGES = {
    "S(2)": "1 of 7: to a round shape",
    "S(1)": "2 of 7: to a rounded cube",
    "cube": "3 of 7: to a cube",
    "corners": "4 of 7: corners fixed",
    "edges": "5 of 7: edges fixed",
    "layout": "before the spline: the surface on a sphere",
    "spline": "6 of 7: the spline",
}
LAST = "7 of 7: solution and report"
LABELS = {"checking": "being checked", "ready": "accepted"}  # the other states are called by their names
CONTENT = {artifact.file: artifact.shows for artifact in ARTIFACTS}
VIEW = Rotation.from_euler("yx", (-40.0, 25.0), degrees=True).as_matrix()  # shows three sides of the cube
ENDED = ("done", "failed", "stopped")
GREY = 190  # of 255
PICKED = (240, 140, 20)
EDGES_UP_TO = 3_000  # faces: surfaces with more are drawn without edges


def row(job: Job, before: int, problem_options: ProblemOptions) -> dict[str, Any]:
    """Return the entry of a job on the page, in JSON's own types.

    before: jobs ahead of it in the queue. problem_options: the problem of the page's options.
    """
    said: dict[str, Any] = {
        "number": job.number,
        "name": job.name,
        "state": job.state,
        "label": LABELS.get(job.state, job.state) + (f", {before} job{'s' * (before > 1)} ahead" if before else ""),
        "what": f"{page_form.in_words(job.problem_options)}; on the volume of {job.parent}"
        if job.problem_options
        else "",
        "text": job.text,
        "starts": job.state in STARTS
        and not (job.problem_options and job.state == "failed"),  # a solve would fail again
        "deletes": job.state in DELETED,
        "stopping": job.state == "running" and job.stop.is_set(),
        "line": job.log[-1] if job.log else "",
        "resumable": has_checkpoint(job.results),
        "mapped": job.mapped is not None,
        "files": _files(job) if job.state in ENDED else [],
    }
    if is_solvable(job) or is_ahead(job):
        said["form"] = page_form.filled(job.problem_options or job.wanted or problem_options)
        said["ahead"] = is_ahead(job)
    if job.surface is not None:
        vertices, faces = len(job.surface.vertices), len(job.surface.faces)
        said["size"] = f"{vertices:,} vertices, {faces:,} faces"
        said["unit"] = job.surface.unit
        said["edges"] = faces <= EDGES_UP_TO
        said["notices"] = list(job.surface.notices)
    if job.progress is not None:
        said["facts"] = _facts(job, job.progress)
        said["share"] = None if job.is_mapped else _share(job.progress)
        said["curve"] = _curve(job.losses)
    return said


def is_solvable(job: Job) -> bool:
    """Return whether another problem can be solved on the job's volume."""
    return job.state in ENDED and job.volume.is_file()


def is_ahead(job: Job) -> bool:
    """Return whether a problem can be stated before the job's surface becomes a volume."""
    return job.state in STARTS and job.surface is not None and not is_solvable(job)


def _facts(job: Job, now: Progress) -> list[list[str]]:
    """Return the facts of a run on the page: the name of each, its value and a remark."""
    is_spline = now.stage == "spline"
    step = f"step {now.step}" + (f" of {now.steps}" if now.seconds_left is not None else "")
    stage = [LAST, "the volume is made"] if job.is_mapped else [STAGES.get(now.stage, now.stage), step]
    aim = "between them the proof decides" if is_spline else "0 is the aim"
    facts = [
        ["Stage", *stage],
        ["Loss", f"{now.loss:.2e}", "minimised by the training"],
        ["Folds at samples", f"{now.folded:,}", aim],
    ]
    if job.state == "running":
        left = None if job.is_mapped else now.seconds_left
        remark = "how much is left is not known" if left is None else f"{clock(left)} of the training left"
        facts.insert(1, ["Time passed", clock(time.time() - job.begun), remark])
    return facts


def _share(now: Progress) -> float | None:
    """Return the share of the present stage that is done; None for a stage that ends once it gains nothing more."""
    return None if now.seconds_left is None else now.step / now.steps


def _files(job: Job) -> list[dict[str, Any]]:
    """Return the result files that exist, their sizes and their content in words."""
    found = [(name, job.results / name) for name in CONTENT if (job.results / name).is_file()]
    return [{"name": name, "size": _size(path.stat().st_size), "shows": CONTENT[name]} for name, path in found]


def _size(count: int) -> str:
    return f"{count / MEGABYTE:.1f} MB" if count >= MEGABYTE else f"{max(1, round(count / 1024))} kB"


def _curve(losses: list[float]) -> str:
    """Return the points of a polyline in a box of 100 x 100: the logarithm of the losses over their steps."""
    logs = np.log10(np.maximum(losses, 1e-300))
    if len(logs) < 2 or not math.isfinite(float(np.ptp(logs))):
        return ""
    x = np.linspace(0.0, 100.0, len(logs))
    y = 95.0 - 90.0 * (logs - logs.min()) / (np.ptp(logs) or 1.0)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def triangles(surface: Surface) -> dict[str, str]:
    """Return the surface's triangles as VTK lists cells: the number of corners before each."""
    return _packed(np.insert(surface.faces, 0, 3, axis=1).astype(np.uint32))


def places(points: Array) -> dict[str, str]:
    """Return points (n, 3) rotated for the browser's camera, which looks along the third axis."""
    return _packed((points @ VIEW.T).astype(np.float32))


def as_placed(points: Array) -> Array:
    """Return points (n, 3) as they were before `places` rotated them."""
    return np.asarray(points @ VIEW)


def colors(points: Array, surface: Surface, *, mapped: bool, picked: IntArray | None = None) -> dict[str, str]:
    """Return red, green and blue (m, 3) of the triangles: of the cube's face each is nearest to.

    Without a map, the triangles are grey, and the picked ones (k,) orange.
    """
    if not mapped:
        plain = np.full(surface.faces.shape, GREY, dtype=np.uint8)
        if picked is not None:
            plain[picked] = PICKED
        return _packed(plain)
    palette = np.array([[int(color[at : at + 2], 16) for at in (1, 3, 5)] for color in FACE_COLORS], dtype=np.uint8)
    return _packed(palette[nearest_faces(points[surface.faces].mean(axis=1))])  # (m, 3)


def _packed(values: NDArray[Any]) -> dict[str, str]:
    data = base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
    return {"bvals": data, "dtype": values.dtype.name}
