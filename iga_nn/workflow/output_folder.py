"""One output folder: held by one run at a time, its report so far, and the clock."""

from __future__ import annotations

import logging
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from parameterize.files import unfinished

from ..errors import InputError, one_line
from ..report import document as reports
from ..report.artifacts import Part, files_of

log = logging.getLogger(__name__)

CHECKPOINT = "checkpoint"


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished output folder and what its report.json says."""

    folder: Path
    report: reports.Report


@dataclass
class RunFolder:
    """One output folder being filled: its report so far, and the clock.

    vector: write plots of curves as PDF, too.
    """

    folder: Path
    vector: bool = False
    report: reports.Report = field(default_factory=lambda: {"schema": reports.SCHEMA})
    seconds: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    @property
    def endings(self) -> tuple[str, ...]:
        """Of the files a plot of curves is written to."""
        return (".png", ".pdf") if self.vector else (".png",)

    @contextmanager
    def timed(self, step: str) -> Iterator[None]:
        """Count the block's seconds as those of `step`."""
        start = time.perf_counter()
        yield
        self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start

    def draw(self, part: Part, **known: Any) -> None:
        """Draw the figures of one part, timed; importing matplotlib and VTK takes part of it.

        known: what the figures show, by the names that the table of artifacts uses. Figures that fail are listed in the
        report as `not_drawn`, with the reason.
        """
        with self.timed("report"):
            try:
                from ..report.figures import draw_figures

                self.note_failures(draw_figures(self.folder, part, known, self.endings))
            except Exception as error:  # matplotlib itself is missing, say: whatever it is, it ends no run
                self.note_failures({"figures": one_line(error) or type(error).__name__})
                log.warning("figures could not be drawn: %s", one_line(error))

    def note_failures(self, failures: dict[str, str]) -> None:
        """Keep for the report what could not be drawn, and why."""
        if failures:
            self.report["not_drawn"] = self.report.get("not_drawn", {}) | failures

    def begin(self, *parts: Part) -> None:
        """Remove what an older run left of these parts, and its report: the input is good, a new result begins."""
        for name in files_of("report", *parts):
            target = self.folder / name
            for old in (target, *unfinished(target)):
                old.unlink(missing_ok=True)

    def write(self, **sections: Any) -> None:
        """Add sections to the report and write it."""
        self.report.update(sections)
        reports.write(self.folder, self.report | {"seconds": self.seconds})

    def finish(self) -> Outcome:
        """Write the total: the result is finished, and needs no checkpoint any more."""
        self.seconds["total"] = time.perf_counter() - self.started
        self.write(seconds=self.seconds)
        if "config" in self.report:  # of a training here
            shutil.rmtree(self.folder / CHECKPOINT, ignore_errors=True)
        return Outcome(self.folder, reports.plain(self.report))


def default_folder(source: str | Path) -> Path:
    """Where results go unless `--out` says so: the input's stem, in the current folder."""
    name = Path(source).name
    return Path(name.split(".")[0] or Path(name).stem)  # the stem of a hidden file starts with its dot


@contextmanager
def open_folder(
    source: str | Path, out: str | Path | None, force: bool, resume: bool = False, vector: bool = False
) -> Iterator[tuple[RunFolder, Outcome | None]]:
    """Make the output folder and hold it, tried before anything costly; on --resume a finished one is the answer."""
    if out == "":
        raise InputError("out is empty: name a folder")
    folder = Path(out) if out is not None else default_folder(source)
    with _writable(folder):
        is_new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with _locked(folder):
            known = reports.read(folder)
            finished = Outcome(folder, known) if known and reports.is_finished(known) and not force else None
            if finished and not resume:
                raise InputError(f"{folder}: holds a finished result; --force replaces it, --out names another folder")
            if has_checkpoint(folder) and not (resume or force):
                raise InputError(f"{folder}: holds an interrupted run; --resume goes on from it, --force starts anew")
            with _writable(folder):
                if not finished:
                    TemporaryFile(dir=folder).close()
            yield RunFolder(folder, vector), finished
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {_way_on(folder)}") from None
    finally:
        if is_new:
            with suppress(OSError):
                folder.rmdir()  # where nothing was written


@contextmanager
def _writable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); --out names another folder") from None


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep other runs out of the folder; where there are no such locks, do without. Raises InputError."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with _writable(folder):
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


def has_checkpoint(folder: Path) -> bool:
    """Whether an interrupted training left something to go on from."""
    return any((folder / CHECKPOINT).glob("*.safetensors"))


def _way_on(folder: Path) -> str:
    """How to go on after an interruption."""
    if has_checkpoint(folder):
        return "the same command with --resume goes on from the checkpoint"
    if (folder / "volume.npz").exists():
        return f"the volume is written: `iga-nn solve poisson {folder / 'volume.npz'}` solves on it"
    return "nothing was computed yet that could be resumed"
