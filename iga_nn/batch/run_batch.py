"""Carries a batch from the surfaces to the table: skips finished surfaces, computes the others, keeps all results."""

import logging
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from threading import RLock

from parameterize.files import save_text

from ..errors import InputError, expected_errors, one_line
from ..options import MapOptions, ProblemOptions, WorkerOptions
from ..options.texts import duration
from ..report import document as reports
from ..rounding import rounded
from ..type_check import check_type
from ..workflow import pipeline
from ..workflow.cost_estimate import warn_of_memory
from ..workflow.output_folder import forget, locked, new_folder, writable
from ..workflow.worker_run import Ended
from .surfaces import demand_one, divided, entries_of
from .table import Batch, Row, page
from .task import Task, Work, compute

log = logging.getLogger(__name__)

INSTALL = "pip install 'iga-nn[batch]'"


@dataclass(frozen=True)
class Running:
    """Hold the progress of a surface.

    share: the finished share of its work.
    """

    name: str
    stage: str
    share: float


Progress = Callable[[Batch, Sequence[Running]], None]


def run_batch(
    surfaces: Sequence[str | Path],
    out: str | Path,
    problem: str = "poisson",
    *,
    mapping: MapOptions | None = None,
    workers: WorkerOptions | None = None,
    split: bool = False,
    force: bool = False,
    vector: bool = False,
    progress: Progress | None = None,
    time_limit: float | str | None = None,
    **given: ProblemOptions | None,
) -> Batch:
    """Parameterize many surfaces and solve a problem on each in worker processes; return the table.

    Each surface has a folder of its own in `out`, named after it; batch.csv, batch.json and batch.html beside them are
    written anew after every surface. One that is finished with the same options is skipped, one that has a checkpoint
    continues from there, and failures are tried again.

    Parameters
    ----------
    surfaces : sequence of str or Path
        Files, folders, patterns, names of samples and models, or "g1", the models of that set.
    out : str or Path
        The folder of the batch.
    problem : str
        "poisson" or "elasticity".
    mapping : MapOptions, optional
        How a surface becomes a volume.
    workers : WorkerOptions, optional
        Options of the worker processes; two of this machine by default.
    split : bool
        Take each body of a file with several, as NAME-0, NAME-1 and so on; one inside another is a cavity, which is
        filled.
    force : bool
        Start all surfaces anew.
    vector : bool
        Write plots of curves as PDF, too.
    progress : callable, optional
        Called after every change with the batch and the list of its running surfaces.
    time_limit : float or str, optional
        Seconds, or a time such as "10min", after which a surface ends with the best result that it has; the same
        command again goes on.
    **given : PoissonOptions or ElasticityOptions
        Options of the problem that is solved on each, under its name: poisson=PoissonOptions(...).

    Returns
    -------
    Batch
        Its `rows`, each with a `state`, a `line` that says why it was refused or failed, and a `report`; its `counts`
        of states, and its `folder`.

    Raises
    ------
    ExpressionError
        For a formula that is refused.
    MeshError
        Where none of the surfaces is there.
    InputError
        For other options, a folder that cannot be written, and where dask is not installed. Surfaces that are refused
        or fail raise nothing.

    Examples
    --------
    >>> import iga_nn
    >>> quick = iga_nn.MapOptions(steps_factor=0.02, control_points=6)
    >>> coarse = iga_nn.PoissonOptions(refine=(0,))
    >>> outcome = iga_nn.run("poisson", "cube", "out/cube", mapping=quick, poisson=coarse)
    >>> batch = iga_nn.run_batch(["cube"], "out", mapping=quick, poisson=coarse)  # is finished already
    >>> len(batch.rows), batch.rows[0].report == outcome.report
    (1, True)
    """
    mapping, workers, problem_options = (
        mapping or MapOptions(),
        workers or WorkerOptions(),
        pipeline.chosen(problem, given),
    )
    for name, value, kind in (
        ("surfaces", surfaces, tuple[str | Path, ...]),
        ("out", out, str | Path),
        ("mapping", mapping, MapOptions),
        ("workers", workers, WorkerOptions),
        ("split", split, bool),
        ("progress", progress, Callable | None),
    ):
        check_type(name, value, kind)
    pipeline.checked(mapping, problem_options)
    if time_limit is not None:
        duration("--time-limit", time_limit)
    if out == "":
        raise InputError("out is empty: name a folder")
    corners = None if mapping.corners is None else Path(mapping.corners).absolute()
    common = replace(mapping, corners=corners, resume=True)
    entries = entries_of([str(surface) for surface in surfaces], Path(out))
    demand_one(entries)
    if split and mapping.component is not None:
        raise InputError("split takes every component: leave --component out")
    tasks = [
        Task(
            entry.name, entry.mesh, entry.folder, replace(common, component=number), problem_options, vector, time_limit
        )
        for entry, number in (
            divided(entries, mapping.max_faces) if split else [(entry, mapping.component) for entry in entries]
        )
    ]
    return run_tasks(Path(out), tasks, workers, force=force, progress=progress)


def run_tasks(
    out: Path,
    tasks: Sequence[Task],
    workers: WorkerOptions,
    *,
    force: bool = False,
    progress: Progress | None = None,
    work: Work = compute,
) -> Batch:
    """Compute tasks as `run_batch` does; their options may differ.

    work: a function of a module that the workers can import; it calls `compute` with its arguments.
    """
    workers.check()
    with locked(out) if out.exists() else new_folder(out):
        batch = Batch(out, tuple(_found(task, force) for task in tasks))
        if "waiting" in batch.counts:
            return _computed(batch, tasks, workers, progress or (lambda *_: None), work)
        _write(batch)
        return batch


def _found(task: Task, force: bool) -> Row:
    """Return the row of a surface by the state of its folder: finished, refused for its content, or waiting."""
    row = Row(task)
    try:
        if force:
            forget(task.folder)
            return row
        finished = pipeline.finished_run(task.mesh, task.folder, task.mapping, task.problem_options, vector=task.vector)
    except expected_errors() as error:
        refused = row.ended(Ended("refused", one_line(error)))
        log.warning("%s", refused.as_line())
        return refused
    return row if finished is None else row.ended(Ended("done", report=finished.report))


def _computed(batch: Batch, tasks: Sequence[Task], workers: WorkerOptions, progress: Progress, work: Work) -> Batch:
    """Return the batch after the computation of all waiting surfaces; the batch is written after each surface."""
    try:
        from . import cluster
    except ModuleNotFoundError as error:
        package = (error.name or "dask").partition(".")[0]
        raise InputError(f"a batch needs {package}, which is not installed: {INSTALL}") from None
    waiting = [number for number, row in enumerate(batch.rows) if row.state == "waiting"]
    running: dict[int, Running] = {}
    one_at_a_time = RLock()  # surfaces end in this thread, and dask reports their progress in another

    def show() -> None:
        with one_at_a_time:
            present = [known for number, known in sorted(running.items()) if batch.rows[number].state == "waiting"]
            progress(batch, present)

    def tell(at: int, stage: str, share: float) -> None:
        number = waiting[at]
        with one_at_a_time:
            before = running[number].share if number in running else 0.0  # a surface may start anew with another cube
            running[number] = Running(batch.rows[number].entry.name, stage, max(share, before))
            show()

    try:
        if workers.scheduler is None:
            count = min(workers.workers, len(waiting))
            wanted = count * cluster.memory_limit(workers)
            what = f"{count} workers may take {rounded(wanted / 1e9, 1)} GB of memory"
            warn_of_memory(wanted / 1e6, what, "lower --workers or --memory-limit, or free some")
        _write(batch)
        show()
        with (
            cluster.connected(workers, len(waiting)) as client,
            closing(cluster.computed(client, [tasks[number] for number in waiting], workers, tell, work)) as ended,
        ):
            for at, how in ended:
                row = batch.rows[waiting[at]].ended(how)
                batch = batch.with_row(waiting[at], row)
                _write(batch)
                log.log(logging.INFO if row.state == "certified" else logging.WARNING, "%s", row.as_line())
                show()
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {batch.summary}; run the same command again to continue") from None
    return batch


def _write(batch: Batch) -> None:
    """Write the three files of the batch anew, each one atomically. Raises InputError."""
    content = {"json": reports.as_json(batch.as_dict()) + "\n", "csv": batch.as_csv(), "html": page(batch)}
    with writable(batch.folder):
        for ending, text in content.items():
            save_text(batch.folder / f"batch.{ending}", text)
