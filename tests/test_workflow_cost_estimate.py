from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from thick_bodies import star

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.report import document as report
from iga_nn.workflow import pace
from iga_nn.workflow.cost_estimate import Forecast, available_memory_mb, before_layout, forecast
from parameterize.config import preset
from parameterize.layouts.planes import exact_blocks as planes
from parameterize.layouts.planes.prisms import prisms
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways import network

CPU = "cpu"
PACKAGES = str(Path(iga_nn.__file__).resolve().parents[1])
QUICK = ["--steps-factor", "0.05", "--control-points", "8"]


def test_it_is_said_in_plain_words():
    assert str(Forecast((125.0, 347.0), 1240.0)) == "about 2 to 6 minutes, 1.2 GB of memory"
    assert str(Forecast((12.0, 89.0), 640.0)) == "about 12 to 89 seconds, 0.6 GB of memory"
    assert str(Forecast((110.0, 120.0), 640.0)) == "about 2 minutes, 0.6 GB of memory"
    assert str(Forecast((0.1, 0.2), 640.0)) == "about 1 second, 0.6 GB of memory"


def test_more_work_takes_longer_and_more_memory():
    """In processor seconds: other programs may keep one of the measurements waiting."""
    bean, fast, clock = iga_nn.sample("bean"), preset("fast"), time.process_time
    quick = forecast(bean, fast.scaled(0.05).with_control_points(8), device=CPU, clock=clock)
    usual = forecast(bean, fast, device=CPU, clock=clock)
    solved = forecast(bean, fast, device=CPU, clock=clock, unknowns=2_000_000, levels=(0, 1, 2))
    paper = forecast(bean, replace(preset("paper"), train=preset("fast").train), device=CPU, clock=clock)
    assert quick.seconds[1] < usual.seconds[0] < usual.seconds[1] < paper.seconds[1]
    assert quick.memory_mb < usual.memory_mb < solved.memory_mb
    assert usual.seconds[0] < solved.seconds[0]


def test_given_corners_on_a_box_are_trained(monkeypatch):
    cube, quick = iga_nn.sample("cube"), preset("fast").with_control_points(8)
    monkeypatch.setattr("iga_nn.workflow.cost_estimate._pass_seconds", lambda *_: 1e-3)
    monkeypatch.setattr("iga_nn.workflow.cost_estimate._product_seconds", lambda *_: 1e-3)
    one = replace(quick, starts=1)  # else a layout along its sharp edges comes first
    exact, trained = forecast(cube, quick, device=CPU), forecast(cube, one, device=CPU, corners=range(8))
    steps = sum(stage.steps for stage in quick.stages)
    assert trained.seconds[0] - exact.seconds[0] > 100 * network._STEP * steps * 1e-3  # at least 100 points a step


FAST = preset("fast")
STAR = star(np.vstack([np.eye(3), -np.eye(3)]))[:2]
OF_BLOCKS = {
    "a ring": (trimesh.creation.torus(2.0, 0.6), FAST, "blocks"),
    "a drum": (trimesh.creation.cylinder(1.0, 1.0, sections=40), FAST.with_blocks(1), "sharp edges"),
}


@pytest.mark.parametrize("name", OF_BLOCKS)
def test_the_time_of_a_way_that_trains_no_network_needs_none(name, monkeypatch):
    """The counts were those of a cube that is trained: 36 s were told for a part of blocks that took 711 s."""
    monkeypatch.setattr("iga_nn.workflow.cost_estimate._pass_seconds", lambda *_: pytest.fail("measured for nothing"))
    mesh, config, way = OF_BLOCKS[name]
    surface = surface_from_arrays(np.array(mesh.vertices), np.array(mesh.faces), name)
    said = forecast(surface, config, device=CPU, clock=time.process_time)
    assert said.way == way and 10.0 < said.seconds[0] < said.seconds[1] < 300.0 and said.memory_mb > 500.0


def test_a_way_without_blocks_for_the_body_has_no_time():
    mesh = trimesh.creation.icosphere(3)
    ball = surface_from_arrays(np.array(mesh.vertices), np.array(mesh.faces), "ball")
    assert forecast(ball, FAST.with_blocks(3), device=CPU).seconds is None
    assert re.fullmatch(r"no forecast of the time for this body, \d\.\d GB of memory", str(Forecast(None, 900.0)))


def test_before_the_layout_parts_and_handles_have_the_times_of_their_kind():
    ring = trimesh.creation.torus(2.0, 0.6)
    smooth = surface_from_arrays(np.array(ring.vertices), np.array(ring.faces), "ring")
    assert before_layout(iga_nn.sample("cube"), 1.0) is None and before_layout(smooth, 2.0) == (40.0, 220.0)


def test_the_unknowns_of_a_level_are_those_of_its_space():
    assert pace.unknowns_of(27000, 1, 3, 1) == pytest.approx(57**3)
    assert pace.unknowns_of(1000 * 4**3, 1000, 3, 0) == pytest.approx(1000 * 3**3)  # each shares faces with others
    assert pace.unknowns_of(1000 * 4**3, 1000, 3, 1) == pytest.approx(1000 * 4**3)
    assert pace.solve_seconds((0, 1), 27000, 1, 3, 3) < pace.solve_seconds((0, 1), 27000, 900, 3, 3)


def test_blocks_of_extrusions_have_their_own_time():
    mesh = trimesh.creation.cylinder(0.4, 2.0, sections=40)
    shaft = surface_from_arrays(np.array(mesh.vertices), np.array(mesh.faces), "shaft")
    cube = forecast(shaft, FAST.with_blocks(1).with_control_points(20), device=CPU, corners=range(8))
    said = forecast(shaft, FAST.with_control_points(20), device=CPU)
    assert said.way == "stacks" and cube.way == "sharp edges" and said.seconds[0] == said.seconds[1]


def test_a_body_that_no_way_suits_is_refused_by_the_run_alone():
    mesh = trimesh.creation.torus(2.0, 0.6)
    ring = surface_from_arrays(np.array(mesh.vertices), np.array(mesh.faces), "ring")
    said = forecast(ring, FAST.with_blocks(1), device=CPU)
    assert (said.seconds, said.way) == (None, "")


@pytest.mark.parametrize(("mesh", "config"), [(trimesh.Trimesh(*STAR), FAST), (trimesh.creation.icosphere(3), FAST)])
def test_a_time_is_told_for_one_cube(mesh, config):
    surface = surface_from_arrays(np.array(mesh.vertices), np.array(mesh.faces), "body")
    said = forecast(surface, config, device=CPU)
    assert said.seconds is not None and said.way == "network" and str(said).startswith("about ")


def test_the_decomposition_of_the_estimate_is_that_of_the_run(monkeypatch):
    asked = []
    monkeypatch.setattr(planes, "prisms", lambda body: asked.append(body) or prisms(body))
    surface, quick = iga_nn.sample("cube"), preset("fast").with_control_points(8)
    forecast(surface, quick, device=CPU)
    assert len(iga_nn.parameterize(surface, quick).attempts) == len(asked) == 1
    forecast(surface, quick.with_blocks(3), device=CPU)
    assert len(asked) == 2


def test_the_calibration_takes_less_than_a_second():
    bean, fast = iga_nn.sample("bean"), preset("fast")
    forecast(bean, fast, device=CPU)  # loads the kernels
    start = time.process_time()
    forecast(bean, fast, device=CPU)
    assert time.process_time() - start < 1.0


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no peak memory of a process of its own")
def test_a_small_run_takes_what_was_said(in_folder):
    """In processor seconds, and resident memory, of a process of its own: other programs may keep this one waiting."""
    script = f"""
import json, resource, sys, time
import iga_nn
from iga_nn.workflow.cost_estimate import forecast
from iga_nn.cli.commands import main
from parameterize.config import preset
config = preset("fast").scaled(0.05).with_control_points(8)
said = forecast(iga_nn.sample("bean"), config, device="cpu", clock=time.process_time)
assert main(["parameterize", "bean", "--device", "cpu", "--quiet", *{QUICK!r}, "--out", "out"]) in (0, 3)
usage = resource.getrusage(resource.RUSAGE_SELF)
with open("/proc/self/status") as status:  # ru_maxrss is that of the process which started this one, if it was larger
    peak = next(float(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1000.0
print(json.dumps([*said.seconds, said.memory_mb, usage.ru_utime + usage.ru_stime, peak]))
"""
    one = dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    path = {"PYTHONPATH": PACKAGES}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, env=os.environ | one | path
    )
    low, high, memory, seconds, peak = json.loads(done.stdout.splitlines()[-1])
    assert low / 3.0 < seconds < 3.0 * high
    assert high < 9.0 * low
    assert memory / 2.0 < peak < 2.0 * memory


def test_it_is_said_before_the_training_and_kept_in_the_report(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "bean", "--out", "out"]) == 0
    (line,) = [text for text in capsys.readouterr().err.splitlines() if text.startswith("estimate:")]
    assert re.fullmatch(r"estimate: about \d+( to \d+)? (minutes|seconds), \d\.\d GB of memory", line)
    found = report.read(in_folder / "out")["estimate"]
    assert 0.0 < found["seconds"][0] < found["seconds"][1] and 300.0 < found["memory_mb"] < 3000.0


def test_quiet_and_json_keep_stdout_for_the_verdict(formula_training, in_folder, capsys):
    formula_training()
    assert main(["run", "poisson", "cube", "--refine", "0", "--out", "out", "--json", "--quiet"]) == 0
    captured = capsys.readouterr()
    assert "estimate" not in captured.err
    json.loads(captured.out)


def test_too_little_memory_is_a_warning_even_when_quiet(formula_training, in_folder, capsys, monkeypatch):
    formula_training()
    monkeypatch.setattr("iga_nn.workflow.cost_estimate.available_memory_mb", lambda: 100.0)
    assert main(["parameterize", "cube", "--out", "out", "--quiet"]) == 0
    assert "GB of memory are needed, 0.1 GB are free" in capsys.readouterr().err


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="read from /proc/meminfo")
def test_free_memory_is_below_all_memory():
    whole = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e6
    assert 0.0 < available_memory_mb() < whole
