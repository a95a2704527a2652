"""What each way to a map and each mechanism earns: left out in turn, on models and on hard surfaces of every kind.

    python examples/benchmarks/ablation.py --jobs 2
    python examples/benchmarks/ablation.py --without race polish --only conch bone
    python examples/benchmarks/ablation.py --stress 3 --out out/ablation_hard

Runs the surfaces with everything, and then once more for each thing that is left out, on those surfaces alone where the
run with everything has used it; the same command skips what is finished. ablation.csv and ablation.md are written anew
after each surface; copy them to results/ when they are to be kept.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from math import exp, log
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import processes
from g1 import DATA_FOLDER, PAPER, REPOSITORY
from hard_shapes import KINDS, LATER, compute_shape, kind_of, name_of

from iga_nn.batch.table import Batch
from iga_nn.batch.table import Row as Known
from iga_nn.batch.task import Task
from iga_nn.level_table import csv_text
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.report import document as reports
from iga_nn.workflow.worker_run import Ended
from parameterize import config
from parameterize.files import save_text
from parameterize.layouts.rods import along_skeleton as layout
from parameterize.optimization import anchors, phases, rounds
from parameterize.optimization.anchors import Anchors
from parameterize.optimization.endings import Reason
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.newton import Acceleration
from parameterize.optimization.sliding import SlidingParameters
from parameterize.ways import blocks, growth, network, one_cube, sharp, strategy, stubs

NAME = "ablation.py"
WHOLE = "nothing"  # is left out
Tried = list[dict[str, Any]]  # the attempts of a report


def any_use(_: Tried) -> bool:
    """Every map uses it."""
    return True


def starts_with(*names: str) -> Callable[[Tried], bool]:
    """Maps use it where one of these starts was tried."""
    return lambda tried: any(one["start"] in names for one in tried)


def trained(tried: Tried) -> bool:
    """Maps use it where a network was trained to the end: a shape that is too hard for it has no rounds."""
    return any(one["start"] == "network" and one["rounds"] for one in tried)


def has_phase(name: str, more_than: int = 0) -> Callable[[Tried], bool]:
    """Maps use it where a phase has had more rounds than so many."""
    return lambda tried: any(one["rounds"].get(name, 0) > more_than for one in tried)


@dataclass(frozen=True)
class Part:
    """What can be left out. leave_out: does so in this process. used: whether a run, by its attempts, has used it."""

    what: str
    leave_out: Callable[[], None]
    used: Callable[[Tried], bool] = any_use


def without_way(name: str) -> Part:
    """Leave a way out."""

    def leave_out() -> None:
        strategy.WAYS = tuple(one for one in strategy.WAYS if one.name != name)

    return Part(f"the way: {name}", leave_out, starts_with(name))


def put(owner: Any, **values: Any) -> Callable[[], None]:
    """Give constants of a module, or attributes of a class, other values."""

    def leave_out() -> None:
        for name, value in values.items():
            assert hasattr(owner, name), f"{owner} has no {name}"
            setattr(owner, name, value)

    return leave_out


def together(*actions: Callable[[], None]) -> Callable[[], None]:
    """Return one action that does them all."""

    def leave_out() -> None:
        for action in actions:
            action()

    return leave_out


def fast(change: Callable[[config.Config], config.Config]) -> Callable[[], None]:
    """Change the default options."""
    return lambda: config.PRESETS.update(fast=change(config.PRESETS["fast"]))


def train(**values: Any) -> Callable[[], None]:
    """Change the default options of the training."""
    return fast(lambda options: replace(options, train=replace(options.train, **values)))


def stages(change: Callable[[config.StageConfig], config.StageConfig | None]) -> Callable[[], None]:
    """Change the default stages of the training after the first one, which decides whether the shape is hard."""

    def changed(options: config.Config) -> config.Config:
        first, *later = options.stages
        return replace(options, stages=(first, *(stage for stage in map(change, later) if stage is not None)))

    return fast(changed)


def no_stage(name: str) -> Callable[[], None]:
    """Leave a stage of the training out."""
    return stages(lambda stage: None if stage.name == name else stage)


def share_of_steps(share: float) -> Callable[[], None]:
    """Take a share of the steps after the first stage."""
    return stages(lambda stage: replace(stage, steps=config.scaled_steps(stage.steps, share)))


def ended(phase: type[phases.Phase], reason: Reason) -> Callable[[], None]:
    """Let a phase end before its first round."""
    return put(phase, done=lambda *_: reason)


def raised_floors() -> None:
    """Let the stiffer growths keep the floors of det J everywhere."""
    raised = {name: replace(getattr(growth, name), least_floor=1.0) for name in ("STIFF", "LAST")}
    others = {one.name: one for one in raised.values()}
    put(growth, **raised)()
    put(strategy, **raised, WAYS=tuple(others.get(one.name, one) for one in strategy.WAYS))()


STIFFER = ("stiff growth", "last growth")
ON_CUBE = ("growth", *STIFFER)  # these start from the surface on a sphere, and then on the cube
GROWN, ON_SPHERE = starts_with("growth", *STIFFER), starts_with(*ON_CUBE)
IN_BLOCKS = starts_with("blocks")
UNFOLDING, PARTING, POLISHING = has_phase("unfold", 1), has_phase("separate"), has_phase("polish")
PARTS: dict[str, Part] = {
    "network": Part("the trained network: every map is grown", train(easy_loss=0.0), trained),
    "giving up": Part("giving up the training: every map is trained to the end", train(easy_loss=None), GROWN),
    "growth": without_way("growth"),
    "stiff growth": without_way("stiff growth"),
    "last growth": without_way("last growth"),
    "sharp edges": Part("the way along sharp edges", put(sharp, ridges_of=lambda _: None), starts_with("sharp edges")),
    "blocks": Part("blocks along limbs", fast(lambda options: replace(options, blocks=1)), IN_BLOCKS),
    "rows": Part("rows of limbs side by side", put(layout, with_rows=lambda skeleton, _: (skeleton, {})), IN_BLOCKS),
    "anchored faces": Part(
        "anchors inside the faces of blocks",
        put(anchors, face_points=lambda _: (np.empty((0, 3)), np.empty(0, dtype=np.int64)), _FACES=anchors._EDGES),
        IN_BLOCKS,
    ),
    "soft rounds": Part(
        "the last rounds of blocks, with the usual weights",
        together(*(put(made, softened=lambda stiff, *_: stiff) for made in (blocks, stubs))),
        starts_with("blocks", "body with stubs"),
    ),
    "merging": Part("merging of near junctions", put(layout, merge=lambda skeleton, _: skeleton), IN_BLOCKS),
    "race": Part("the race between two turns of the cube", train(race=0.0), trained),
    "whitening": Part("the affine map before the network", train(whiten=False), starts_with("network")),
    "muon": Part("Muon: Adam trains all", train(matrix_rate=0.0), starts_with("network")),
    "S(1)": Part("the stage S(1)", no_stage("S(1)"), trained),
    "half the steps": Part("half of the steps after the first stage", share_of_steps(0.5), trained),
    "third of the steps": Part("two thirds of the steps after the first stage", share_of_steps(1.0 / 3.0), trained),
    "turning": Part("the turn of the cube before growth", put(one_cube, best_turn=lambda *_: np.eye(3)), ON_SPHERE),
    "coarse rounds": Part(
        "first rounds on fewer control points",
        together(put(network, COARSE=1.0), put(sharp, COARSE=1.0), put(growth, _COARSE=1.0)),
        starts_with("network", *ON_CUBE),
    ),
    "lowered floors": Part("floors of det J that are lowered in thin parts", raised_floors, starts_with(*STIFFER)),
    "stiffening": Part("more weight of unproved spans, round by round", put(rounds, _SPAN_MOST=1.0), UNFOLDING),
    "giving way": Part(
        "less weight of the surface at unproved spans",
        together(put(phases, RELAXING=1.0, _CONTACT_WAY=1.0), put(rounds, RELAXING=1.0)),
        UNFOLDING,
    ),
    "smoothing": Part("smoothing near a few unproved spans", put(phases, _MOST_SMOOTHED=0), UNFOLDING),
    "parting": Part("pushing apart a boundary that meets itself", ended(phases.Separate, Reason.APART), PARTING),
    "polish": Part("giving the surface its weight back", ended(phases.Polish, Reason.LESS_POLISHED), POLISHING),
    "moving back": Part("moving back near spans that fold again", put(phases, _MENDINGS=0), POLISHING),
    "drawn edges": Part(
        "anchors that draw edges to the surface", put(Anchors, aim=lambda own, _: own.release()), POLISHING
    ),
    "facing": Part("the penalty on normals that do not agree", put(SplineEnergy, watch_alignment=lambda *_: None)),
    "relaxing": Part("untangling of the layout after each step", put(SlidingParameters, relax=lambda *_: None)),
    "Anderson": Part("Anderson's guess at the limit of the steps", put(Acceleration, guess=lambda _: None)),
}


@dataclass(frozen=True, kw_only=True)
class Row(processes.MapColumns):
    """What is known of one surface without one part, the columns of ablation.csv.

    arap: the mean at volume 1. distance: of surface and spline, rms both ways, over the diagonal of the box. same:
    whether the run with everything has not used the part, so that its figures are these.
    """

    without: str
    surface: str
    kind: str  # "model", or one of the hard surfaces
    same: bool = False
    verdict: str | None = None
    one_to_one: str | None = None
    arap: float | None = None
    distance: float | None = None
    seconds: float | None = None
    error: str | None = None


@dataclass(frozen=True)
class Options:
    """What to run and where the tables go. meshes: by the name of the surface."""

    parts: tuple[str, ...]
    meshes: dict[str, Path]
    jobs: int
    out: Path


def main(argv: list[str] | None = None) -> int:
    """Run the surfaces and write the tables; 0 done, 2 bad arguments, 130 interrupted."""
    options = _options(argv)
    rows: dict[tuple[str, str], Row] = {}
    for part in (WHOLE, *options.parts):
        names = list(options.meshes)
        if part != WHOLE:
            names = [name for name in names if _uses(part, name, options.out)]
            for name in set(options.meshes) - set(names):
                rows[part, name] = replace(rows[WHOLE, name], without=part, same=True)

        def keep(batch: Batch, part: str = part) -> None:
            for known in batch.rows:
                if known.state != "waiting":
                    rows[part, known.entry.name] = row_of(part, known)
            write_tables(list(rows.values()), options)

        tasks = [Task(name, str(options.meshes[name]), options.out / part / name, MAPPING, None) for name in names]
        workers = WorkerOptions(workers=options.jobs, memory_limit="0")
        with options_without(part):
            if tasks and (code := processes.run(NAME, options.out / part, tasks, workers, keep, compute_without)):
                return code
    write_tables(list(rows.values()), options)
    print(as_text(list(rows.values()), options))
    return 0


MAPPING = MapOptions(device="cpu", resume=True)
FIRST, LATER_FIRST = 120, 40  # the hard surfaces begin here: the tables of the stress set have these, too


def _options(argv: list[str] | None) -> Options:
    parser = processes.parser_of_surfaces(NAME, __doc__, Path("out/ablation"))
    models = Path(os.environ.get(DATA_FOLDER) or REPOSITORY.parent / "shared" / "models")
    parser.add_argument("--models", type=Path, default=models, help=f"folder of NAME.obj (default: {models})")
    parser.add_argument("--without", nargs="+", default=list(PARTS), metavar="PART", help="leave out these parts alone")
    parser.add_argument("--only", nargs="+", default=None, metavar="NAME", help="these models alone")
    parser.add_argument("--stress", type=int, default=0, help="hard surfaces of every kind beside them (default: 0)")
    given = parser.parse_args(argv)
    processes.demand_positive(parser, given, "jobs")
    if unknown := sorted(set(given.without) - set(PARTS)):
        parser.error(f"--without {' '.join(unknown)}: no such part; there are {', '.join(PARTS)}")
    processes.demand_runnable(parser, MAPPING, given.out)
    out = given.out.absolute()
    there = [name for name in PAPER if (given.models / f"{name}.obj").is_file()]
    names = there if given.only is None else given.only
    if unknown := sorted(set(names) - set(there)):
        parser.error(f"--only {' '.join(unknown)}: no such model in {given.models}")
    meshes = {name: (given.models / f"{name}.obj").absolute() for name in names}
    numbers = [number for kind in KINDS for number in _numbers(kind, given.stress)]
    meshes |= {name: out / "surfaces" / f"{name}.obj" for name in map(name_of, numbers)}
    return Options(tuple(given.without), meshes, given.jobs, out)


def _numbers(kind: str, count: int) -> list[int]:
    """The first numbers of a kind from FIRST on, or from LATER + LATER_FIRST on."""
    first = FIRST if any(kind_of(number) == kind for number in range(LATER)) else LATER + LATER_FIRST
    return [number for number in range(first, first + LATER) if kind_of(number) == kind][:count]


@contextmanager
def options_without(part: str) -> Iterator[None]:
    """Give this process the default options without a part: by these it knows what is finished. Others compute."""
    presets = dict(config.PRESETS)
    try:
        if part != WHOLE:
            PARTS[part].leave_out()
        yield
    finally:
        config.PRESETS.update(presets)


def compute_without(task: Task, number: int, batch: str) -> Ended:
    """Leave out the part that the folder names, and compute the surface; the worker computes no other part's."""
    global _left_out
    part = task.folder.parent.name
    assert _left_out in (None, part), f"this worker has left out {_left_out} already"
    if _left_out is None and part != WHOLE:
        PARTS[part].leave_out()
    _left_out = part
    return (compute_shape if Path(task.mesh).parent.name == "surfaces" else processes.compute_measured)(
        task, number, batch
    )


_left_out: str | None = None  # in this worker


def _uses(part: str, name: str, out: Path) -> bool:
    """Whether the run with everything has used a part; False where it has made no map."""
    report = reports.read(out / WHOLE / name)
    return report is not None and PARTS[part].used(report["parameterization"]["attempts"])


def row_of(part: str, known: Known) -> Row:
    """Return all figures of one surface, from its report; why there are none as the error."""
    name = known.entry.name
    kind = name.partition("-")[2] or "model"
    if known.report is None:
        return Row(without=part, surface=name, kind=kind, error=known.line)
    quality = known.report["parameterization"]
    return Row(
        without=part,
        surface=name,
        kind=kind,
        verdict=quality["bijective"],
        one_to_one=reports.one_to_one(known.report),
        arap=quality["arap"]["unit_volume"]["mean"],
        distance=reports.surface_distance(known.report).get("rms"),
        seconds=processes.times_of(known).get("seconds"),
        **processes.attempts_of(known.report),
    )


HEAD = (
    "left out", "what it is", "surfaces", "used by", "certified, one-to-one", "ARAP", "distance", "seconds",
    "largest change of ARAP", "of distance",
)  # fmt: skip
HEADED = ("arap", "distance")  # whose largest change the table shows


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """Write ablation.csv and ablation.md with the rows so far; each replaced in one go."""
    save_text(options.out / "ablation.csv", csv_text(processes.columns_of(Row), map(asdict, rows)))
    save_text(options.out / "ablation.md", as_text(rows, options))


def as_text(rows: Sequence[Row], options: Options) -> str:
    """Return the table, and the machine."""
    whole = {row.surface: row for row in rows if row.without == WHOLE}
    own = {part: [row for row in rows if row.without == part] for part in options.parts}
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    parts = [
        "# What each way and each mechanism earns",
        "Each is left out in turn. ARAP, distance and seconds are geometric means, over the surfaces that use it, of "
        "the ratio to the run with everything: above 1, leaving it out makes them larger.",
        processes.as_markdown(HEAD, [_cells(part, found, whole) for part, found in own.items() if found]),
        f"With everything: {_sound(list(whole.values()))} of {len(whole)} certified and one-to-one.",
        f"{processes.processor()}, {processes.cores()} cores, {options.jobs} at a time; {versions}.",
    ]
    return "\n\n".join(parts) + "\n"


def _sound(rows: Sequence[Row]) -> int:
    return sum(row.verdict == "certified" and row.one_to_one == "yes" for row in rows)


def _cells(part: str, rows: Sequence[Row], whole: dict[str, Row]) -> list[str]:
    """Return one row of the table."""
    own = [row for row in rows if not row.same]
    ratios = {name: _ratios(name, own, whole) for name in ("arap", "distance", "seconds")}
    means = [f"{exp(fmean(map(log, found))):.3f}" if found else "" for found in ratios.values()]
    most = [f"{max(ratios[name], key=lambda r: abs(log(r))):.2f}" if ratios[name] else "" for name in HEADED]
    return [part, PARTS[part].what, str(len(rows)), str(len(own)), str(_sound(rows)), *means, *most]


def _ratios(name: str, rows: Sequence[Row], whole: dict[str, Row]) -> list[float]:
    """Return a figure of each row over that of the run with everything, where both are known."""
    pairs = [(getattr(row, name), getattr(whole[row.surface], name)) for row in rows]
    return [ours / theirs for ours, theirs in pairs if ours and theirs]


if __name__ == "__main__":
    raise SystemExit(main())
