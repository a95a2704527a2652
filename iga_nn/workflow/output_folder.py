"""Holds one output folder for one run: its report so far, and the clock."""

import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, get_args

from parameterize.checkpoint import KEPT
from parameterize.files import digest, unfinished
from parameterize.progress import timed
from parameterize.time_limit import OutOfTime, present_limit

from ..errors import InputError, TimeLimitError
from ..report import document as reports
from ..report.artifacts import REPORT, Part, files_of
from .drawing import Failures, Figures, draw, drawing
from .painter import Painter
from .time_limit import is_late, stopped_in_words

CHECKPOINT = "checkpoint"
NO_TIME = "the time limit is over"


@dataclass(frozen=True, eq=False)
class Outcome:
    """Hold a finished output folder and the content of its report.json."""

    folder: Path
    report: reports.Report


@dataclass
class RunFolder:
    """Fill one output folder in one run, with the report so far and the clock.

    vector: whether plots of curves are also written as PDF. finished: the result that a resumed run found complete.
    guarded: whether files without a report belong to the user, and are not replaced. make: a function that makes the
    folder, where it does not exist. painter: draws the figures beside the run; None where the run draws them.
    """

    folder: Path
    vector: bool = False
    finished: Outcome | None = None
    guarded: bool = False
    make: Callable[[], None] | None = None
    painter: Painter | None = None
    report: reports.Report = field(default_factory=lambda: {"schema": reports.SCHEMA})
    seconds: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def timed(self, step: str) -> AbstractContextManager[None]:
        """Return a context that adds its seconds to those of `step`."""
        return timed(self.seconds, step)

    def draw(self, part: Part, **known: Any) -> None:
        """Draw the figures of one part of a run for which the values `known`, by their names in the table, suffice.

        Where there is a painter, they are done at `wait_for_figures`.
        """
        if is_late():
            self._tell({f"figures of the {part}": NO_TIME})
            return
        figures = Figures(self.folder.resolve(), part, known, self.vector)
        with self.timed("report"):
            if self.painter is None or not self.painter.begin(figures):
                self._tell(draw(figures))

    def wait_for_figures(self) -> None:
        """Wait until all figures are drawn, and add those that could not be to the report."""
        if self.painter is not None and is_late():
            self._tell({"some figures": NO_TIME})
        elif self.painter is not None:
            with self.timed("report"):
                self._tell(self.painter.end())

    @contextmanager
    def drawing(self, what: str) -> Iterator[None]:
        """Let the block draw `what`; a failure, for example the import of matplotlib or VTK, goes into the report."""
        failures: Failures = {}
        with drawing(what, failures):
            yield
        self._tell(failures)

    def _tell(self, failures: Failures) -> None:
        if failures:
            self.report.setdefault("not_drawn", {}).update(failures)

    def begin(self, *parts: Part) -> None:
        """Make the folder, or remove from it the report and the files of these parts from an older run.

        Call this once the input is accepted. Raises InputError where the folder cannot be made, where it contains such
        a file but no readable report of its run, and where the report of a training would be removed without its map.
        """
        if self.make is not None:
            make, self.make = self.make, None
            make()
        if "map" not in parts and "config" in (reports.read(self.folder) or {}):
            what = "holds a map and the report of its training, which would be lost"
            raise InputError(f"{self.folder}: {what}; --out names another folder")
        targets = [self.folder / name for name in files_of("report", *parts)]
        kept = [target.name for target in targets if target.exists()]
        if self.guarded and kept:
            what = f"{REPORT} is damaged" if REPORT in kept else f"holds {kept[0]} without a report of its run"
            if {REPORT, "volume.npz"} <= set(kept):
                what += f"; `iga-nn solve poisson {self.folder / 'volume.npz'}` solves on its volume"
            raise InputError(f"{self.folder}: {what}; --force replaces the files there, --out names another folder")
        for target in targets:
            target.unlink(missing_ok=True)
        self.sweep(*parts)

    def sweep(self, *parts: Part) -> None:
        """Remove what a killed run has left of files that it was writing; without `parts` those of all of them."""
        for name in files_of("report", *(parts or get_args(Part))):
            for old in unfinished(self.folder / name):
                old.unlink(missing_ok=True)

    def write(self, **sections: Any) -> None:
        """Add sections to the report and write it."""
        if "parameterization" in sections:
            sections["parameterization"] = reports.summarized(sections["parameterization"])
        self.report.update(sections)
        reports.write(self.folder, self.report | {"seconds": self.seconds})

    def finish(self, page: Callable[[Path, reports.Report], object]) -> Outcome:
        """Write the page, then the total time, which marks the result as finished, and remove the checkpoint.

        page: a function that writes the page of a report into the folder.

        A result that a time limit has cut short is none that is finished, and keeps its checkpoint.
        """
        if said := stopped_in_words():
            self.report["incomplete"] = said
        self.wait_for_figures()
        self.seconds["total"] = time.perf_counter() - self.started
        page(self.folder, reports.plain(self.report | {"seconds": self.seconds}))
        self.write(seconds=self.seconds)
        if "incomplete" not in self.report:
            shutil.rmtree(self.folder / CHECKPOINT, ignore_errors=True)
        return Outcome(self.folder, reports.plain(self.report))


def default_folder(source: str | Path) -> Path:
    """Return the folder of the results without `--out`: the input's stem, in the current folder."""
    name = Path(source).name
    return Path(name.split(".")[0] or Path(name).stem)  # the name of a hidden file starts with its dot


@contextmanager
def open_folder(
    source: str | Path, out: str | Path | None, force: bool, resume: bool = False, vector: bool = False
) -> Iterator[RunFolder]:
    """Hold the output folder for one run and yield it; `RunFolder.begin` makes a folder that does not exist.

    A refused input leaves nothing behind: a new folder that stays empty is removed at the end. Raises InputError,
    before any long computation, where the folder cannot be written or another run uses it, and where it contains a
    result or an interrupted run and neither `force` nor `resume` is set.
    """
    if out == "":
        raise InputError("out is empty: name a folder")
    folder = Path(out) if out is not None else default_folder(source)
    with writable(folder):
        is_there = folder.exists()
    try:
        with ExitStack() as held:
            if not is_there:
                yield RunFolder(folder, vector, make=lambda: held.enter_context(new_folder(folder)))
                return
            held.enter_context(locked(folder))
            finished = _finished_result(folder, force, resume)
            if not finished:
                with writable(folder):
                    TemporaryFile(dir=folder).close()
            guarded = not force and not has_checkpoint(folder) and reports.read(folder) is None
            yield RunFolder(folder, vector, finished, guarded)
    except OutOfTime:
        said = f"{folder}: the {present_limit() or 'time limit'} is reached before there is a result"
        raise TimeLimitError(f"{said}; {_way_on(folder)}") from None
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {_way_on(folder)}") from None


@contextmanager
def new_folder(folder: Path) -> Iterator[None]:
    """Make a folder with those above it, hold it, and remove the empty ones at the end. Raises InputError."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        with writable(folder):
            folder.mkdir(parents=True)  # where another run has made it since, that one has it
        with locked(folder):
            yield
    finally:
        with suppress(OSError):  # one is not empty, nor are those above it
            for place in missing:
                place.rmdir()


def _finished_result(folder: Path, force: bool, resume: bool) -> Outcome | None:
    """Return the finished result in the folder for a run that resumes. Raises InputError as `open_folder` does."""
    if force:
        return None
    known = reports.read(folder)
    finished = Outcome(folder, known) if known and reports.is_finished(known) else None
    if finished and not resume:
        raise InputError(f"{folder}: holds a finished result; --force replaces it, --out names another folder")
    if has_checkpoint(folder) and not resume:
        raise InputError(f"{folder}: holds an interrupted run; --resume continues it, --force starts anew")
    if known and not finished and not resume and reports.solved(known):
        what = "holds levels of an interrupted solve; --force solves all anew, --out names another folder"
        raise InputError(f"{folder}: {what}")
    return finished


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Turn an OSError of the block into an InputError with the remedy."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); --out names another folder") from None


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the folder against other runs, where the system has locks. Raises InputError where another run holds it.

    The lock is on the folder itself, because a lock file would remain among the results.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    with writable(folder):
        handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without locks
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(f"{folder}: in use by another run; wait, or name another folder with --out") from None
        yield
    finally:
        os.close(handle)


def forget(folder: Path) -> None:
    """Let the next run start anew: write a report that marks no result as finished, and remove the checkpoint.

    Raises InputError where another run uses the folder, or where it cannot be written.
    """
    if folder.is_dir():
        with locked(folder), writable(folder):
            reports.write(folder, {"schema": reports.SCHEMA})
            shutil.rmtree(folder / CHECKPOINT, ignore_errors=True)


def _last_kept(folder: Path) -> str:
    """Return in words what the last checkpoint in the folder holds."""
    last = max((folder / CHECKPOINT).glob("*.safetensors"), key=lambda path: path.stat().st_mtime_ns)
    return KEPT.get(last.name.split(".")[0].split("-")[0], "the checkpoint")


def changed_file(folder: Path, report: reports.Report, names: Sequence[str]) -> str:
    """Return the first of some files that is not there, or has changed since the report was written; "" for none.

    The report has the digests of the files of a map; of one without them, only files that are gone are told.
    """
    known = report.get("files")
    known = known if isinstance(known, dict) else {}
    found = {name: digest(folder / name) for name in names}
    return next((name for name in names if not found[name] or found[name] != known.get(name, found[name])), "")


def has_checkpoint(folder: Path) -> bool:
    """Return whether an interrupted training left a checkpoint in the folder."""
    return any((folder / CHECKPOINT).glob("*.safetensors"))


def _way_on(folder: Path) -> str:
    """Return in words what is done, and how to continue after an interruption."""
    report = reports.read(folder) or {}
    if has_checkpoint(folder):
        is_mapped = "parameterization" in report and not reports.solved(report)
        last = "the map" if is_mapped else _last_kept(folder)
        return f"the same command with --resume continues from {last}, and does again what came after"
    if "study" in report:
        return f"the solves that are done are in {folder / 'study.csv'}"
    if levels := reports.solved(report).get("levels"):
        return f"{len(levels)} level{'s' * (len(levels) > 1)} done, in {folder / REPORT}"
    if (folder / "volume.npz").exists():
        return f"the volume is written: `iga-nn solve` with {folder / 'volume.npz'} solves on it"
    return "nothing was computed yet that could be resumed"
