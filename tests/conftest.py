"""What the tests of the front door share: a training that takes no time. Imports wait until they are used."""

from __future__ import annotations

import asyncio
import functools
import inspect
import locale
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before the libraries that read it
for _number in (signal.SIGINT, signal.SIGTERM):
    if signal.getsignal(_number) is signal.SIG_IGN:  # `nohup make test &`; what the tests start would inherit it
        signal.signal(_number, lambda *_: None)  # so it is ignored here alone: a new program starts with the default
LOCALE = locale.setlocale(locale.LC_ALL)
STAGES = ("S(2)", "S(1)", "cube", "corners", "edges")


@functools.cache
def formula_parameterization(amplitude: float = 0.08, **given: Any) -> Any:
    """A result as training leaves it, from the benchmark map; amplitude 0.4 folds it."""
    from iga_nn.samples import sample
    from parameterize.certificate.boundary import check_boundary
    from parameterize.certificate.certify import certify
    from parameterize.config import preset
    from parameterize.cube.boundary_map import BoundaryMap
    from parameterize.quality.quality import measure
    from parameterize.run import Parameterization
    from parameterize.ways.tried import AttemptReport
    from solve.study import benchmark_volume

    cube = sample("cube")
    volume = benchmark_volume(4, amplitude=amplitude)
    boundary = BoundaryMap(volume(cube.vertices), cube.vertices, cube.faces)
    certificate = certify(volume)
    quality = measure(
        volume, boundary.vertices, boundary.faces, cube.scale, boundary, certificate, check_boundary(volume)
    )
    steps = np.arange(50)
    history = {
        "stage": np.repeat(STAGES, 10),
        "step": np.tile(np.arange(10), 5),
        "loss": np.exp(-0.1 * steps),
        "folded": np.maximum(0, 20 - steps),
        "arap": 0.3 * np.exp(-0.05 * steps),
        "cor": np.where(steps < 30, np.nan, 1e-3),
    }
    seconds = {"train": 1.0, "fit": 0.5, "optimize": 0.5, "certify": 0.1}
    return Parameterization(
        volume=volume,
        boundary=boundary,
        certificate=certificate,
        quality=quality,
        history=history,
        seconds=seconds,
        device="cpu",
        seed=given.get("seed", 0),
        config=given.get("config") or preset("fast"),
        origin="network",
        attempts=(
            AttemptReport(*["network"] * 2, "certified and polished", {"shape": 2}, {"shape": 0.5}, 0, False, 0.0),
        ),
    )


@functools.cache
def found_once() -> dict[str, Any]:
    """What runs find again and again, kept: how fast this machine is, and the samples as the gate lets them in."""
    from iga_nn import models
    from iga_nn.workflow import cost_estimate

    gate, known = models.surface_from_arrays, {}

    def admitted(vertices: Any, faces: Any, name: str, **options: Any) -> Any:
        key = (name, *sorted(options.items()))
        if key not in known:
            known[key] = gate(vertices, faces, name, **options)
        return known[key]

    return {
        "iga_nn.models.surface_from_arrays": admitted,
        "iga_nn.workflow.cost_estimate._pass_seconds": functools.cache(cost_estimate._pass_seconds),
        "iga_nn.workflow.cost_estimate._product_seconds": functools.cache(cost_estimate._product_seconds),
    }


def told(result: Any, when_made: Any) -> Any:
    """Return a map that is there already, and tell of it as `parameterize` does."""
    if when_made is not None:
        when_made(result.volume, result.history)
    return result


@pytest.fixture(autouse=True)
def same_locale() -> None:
    """Take back the locale that VTK leaves behind where a test, or what it is collected from, writes a .vtk file."""
    locale.setlocale(locale.LC_ALL, LOCALE)


@pytest.fixture
def formula_training(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Replace the training by the benchmark map: `formula_training()`, or with an amplitude, or an error to raise."""

    for name, kept in found_once().items():
        monkeypatch.setattr(name, kept)

    def install(amplitude: float = 0.08, error: BaseException | None = None) -> None:
        from parameterize.progress import Progress

        result = formula_parameterization(amplitude)

        def parameterize(
            surface: Any, config: Any = None, *, progress: Any = None, when_made: Any = None, **_: Any
        ) -> Any:
            if error is not None:
                raise error
            for step in range(3):
                if progress is not None:
                    progress(Progress("S(2)", step, 3, 0.5, 0, 1.0))
            return told(result, when_made)

        monkeypatch.setattr("parameterize.run.parameterize", parameterize)

    return install


@pytest.fixture
def few_distances(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure distances at few points of the boundary: they are half of what so short a run takes."""
    from small_run import FEW

    from parameterize.spline.sampled_boundary import SampledBoundary

    monkeypatch.setattr(SampledBoundary.of.__func__, "__defaults__", FEW)


@pytest.fixture
def coarse_regions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Integrate conditions on regions coarsely, where not the numbers are looked at."""
    from coarse_rims import coarse_rims

    coarse_rims(monkeypatch.setattr)


@pytest.fixture(scope="module")
def trained() -> dict[Any, Any]:
    """What short trainings of a file have found: what is asked for again would be the same bits."""
    return {}


@pytest.fixture
def short_training(
    monkeypatch: pytest.MonkeyPatch, few_distances: None, coarse_regions: None, trained: dict[Any, Any]
) -> None:
    """Train and optimise for about a second wherever a training is asked for, with at most 8 control points."""
    from small_run import shortened

    import iga_nn
    import parameterize.run as home
    from parameterize.config import preset

    full = iga_nn.parameterize  # loaded before it is replaced: else what replaces it would be put back
    defaults = {name: one.default for name, one in list(inspect.signature(full).parameters.items())[2:]}
    for name, kept in found_once().items():
        monkeypatch.setattr(name, kept)

    @functools.wraps(full)
    def parameterize(surface: Any, config: Any = None, when_made: Any = None, **options: Any) -> Any:
        short = shortened(config or preset("fast"))
        short = short.with_control_points(min(8, short.spline.control_points))
        changes_nothing = ("progress", "when_made", "checkpoint_dir")
        given = {name: str(value) for name, value in (defaults | options).items() if name not in changes_nothing}
        body = (surface.vertices.tobytes(), surface.faces.tobytes(), surface.sharp)  # also from another file
        groups = [(name, faces.tobytes()) for name, faces in surface.groups.items()]
        asked = (*body, *groups, short, *sorted(given.items()))
        if asked not in trained:
            trained[asked] = full(surface, short, **options)
        return told(trained[asked], when_made)

    monkeypatch.setattr(home, "parameterize", parameterize)
    monkeypatch.setattr(iga_nn, "parameterize", parameterize, raising=False)


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a batch compute its surfaces one after the other in this process, where a training can be replaced."""
    from types import SimpleNamespace

    from iga_nn.batch import cluster

    def computed(client: Any, tasks: Any, options: Any, tell: Any, work: Any = cluster.compute) -> Any:
        for number, task in enumerate(tasks):
            yield number, work(task, number, "batch")

    worker = SimpleNamespace(log_event=lambda topic, message: None)
    monkeypatch.setattr("distributed.get_worker", lambda: worker)
    monkeypatch.setattr(cluster, "connected", lambda *_: nullcontext())
    monkeypatch.setattr(cluster, "computed", computed)


@pytest.fixture
def small_views(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let VTK draw a quarter of the pixels, of coarser patches: without a graphics card a figure costs as much."""
    monkeypatch.setattr("iga_nn.figures.style.PANEL", (220, 171))
    for module in ("map", "fields"):
        monkeypatch.setattr(f"iga_nn.figures.{module}.SAMPLES", 31)
    monkeypatch.setattr("iga_nn.figures.fields.OF_SEVERAL", (21, 9))


@pytest.fixture
def in_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, small_views: None
) -> Path:
    """Make an empty current folder; figures are drawn in this process, and for tests marked `pictures` only.

    What VTK draws, at seconds a figure, is left out for the others, and curves, half of a run without a training, are
    empty files.
    """
    monkeypatch.setattr("iga_nn.workflow.painter.Painter", nullcontext)
    if request.node.get_closest_marker("pictures") is None:
        monkeypatch.setattr("iga_nn.figures.render.can_draw", lambda: False)
        monkeypatch.setattr("iga_nn.figures.panels.Picture.savefig", lambda _, path, **__: Path(path).touch())
        empty = SimpleNamespace(draw=lambda: None, buffer_rgba=lambda: np.zeros((1, 1, 4), dtype=np.uint8))
        monkeypatch.setattr("iga_nn.figures.style.FigureCanvasAgg", lambda _: empty)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def chromium() -> str:
    """The browser's program."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        pytest.skip("no chromium on this machine; remedy: apt-get install --no-install-recommends chromium")
    return found


@pytest.fixture(scope="module")
def in_browser(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[Any], Any]]:
    """A function that returns what a coroutine of a browser returns; one Chromium is as new for each."""
    from browser import running

    async def alone(browser: Any, work: Any) -> Any:
        async with browser.fresh() as one:
            return await work(one)

    with asyncio.Runner() as runner:
        started = running(chromium, tmp_path_factory.mktemp("browser"))
        browser = runner.run(started.__aenter__())
        yield lambda work: runner.run(alone(browser, work))
        runner.run(started.__aexit__(None, None, None))
