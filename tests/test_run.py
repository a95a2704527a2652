"""The whole way on a small surface, with options that take about a second."""

from dataclasses import replace
from typing import get_args
from unittest import TestCase

import numpy as np
import pytest
import torch
from block_starts import torus
from shapes import turned
from small_run import FEW, STEPS, small_surface, tiny_config

from parameterize.certificate.certify import certify
from parameterize.checkpoint import CheckpointError
from parameterize.config import NetworkConfig, StageConfig, StageName
from parameterize.cube import boundary_map, edge_paths
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.cube.cube import CORNERS
from parameterize.cube.cutting import subdivide_finely
from parameterize.optimization.phases import FIRM_ROUNDS
from parameterize.run import corner_vertices, parameterize
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.surface.errors import MeshError
from parameterize.surface.surface import surface_from_arrays
from parameterize.training.backend import choose_device, choose_precision
from parameterize.training.trainer import start_map
from parameterize.ways.mapping_task import MOST_POINTS


@pytest.fixture(scope="module", autouse=True)
def few_distances():
    """For the fixtures of this file, too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SampledBoundary.of.__func__, "__defaults__", FEW)
        yield


@pytest.fixture(scope="module")
def surface():
    return small_surface()


@pytest.fixture(scope="module")
def undisturbed(surface):
    return parameterize(surface, tiny_config(), seed=3, device="cpu")


def same_result(first, second):
    assert np.array_equal(first.volume.control_points, second.volume.control_points)
    assert np.array_equal(first.boundary.parameters, second.boundary.parameters)
    assert first.history.keys() == second.history.keys()
    for name, column in first.history.items():
        assert np.array_equal(column, second.history[name], equal_nan=column.dtype.kind == "f"), name


def test_end_to_end(surface, undisturbed):
    result, n = undisturbed, len(surface.vertices)
    assert result.volume.shape == (6, 6, 6) and result.volume.degrees == (3, 3, 3)
    assert certify(result.volume).verdict == result.certificate.verdict
    assert np.array_equal(result.boundary.vertices[:n], surface.vertices)
    assert np.array_equal(result.boundary.part.faces, surface.faces)
    assert result.boundary.part.group("top").tolist() == surface.groups["top"].tolist()
    gaps = np.linalg.norm(result.volume(result.boundary.parameters[:n]) - surface.vertices, axis=1)
    assert np.sqrt((gaps**2).mean()) < 0.1  # of a body two units wide
    assert result.certificate.mean_det == pytest.approx(surface.volume, rel=0.1)
    assert result.device == "cpu" and result.seed == 3 and result.config == tiny_config()
    assert set(result.seconds) == {"train", "fit", "optimize", "certify"}
    assert isinstance(result.boundary, BoundaryMap) and len(result.boundary.cube_faces) == len(result.boundary.faces)


def test_cut_vertices_are_fitted_to_the_volume_and_leave_it_as_it_is(surface, undisturbed, monkeypatch):
    monkeypatch.setattr(boundary_map, "_FITTING_STEPS", 0)
    plain = parameterize(surface, tiny_config(), seed=3, device="cpu")
    assert np.array_equal(plain.volume.control_points, undisturbed.volume.control_points)
    assert not np.array_equal(plain.boundary.parameters, undisturbed.boundary.parameters)


def test_where_the_edges_cannot_be_traced_training_and_layout_say_so(surface, monkeypatch, caplog):
    monkeypatch.setattr(edge_paths, "_ORDERS", 0)
    monkeypatch.setattr("parameterize.ways.network._FEW_FLIPS", -1.0)
    config = tiny_config()
    parameterize(surface, replace(config, spline=replace(config.spline, rounds=1)), seed=3, device="cpu")
    assert "training ends before stage edges: no path left" in caplog.text
    assert "the first layout has flipped triangles: no path left" in caplog.text


def test_history_has_a_row_a_step(undisturbed):
    stages, counts = np.unique(undisturbed.history["stage"], return_counts=True)
    found = dict(zip(stages.tolist(), counts.tolist(), strict=True))
    assert [found[s.name] for s in tiny_config().stages] == list(STEPS)
    assert 0 < found["spline"] <= 6
    lengths = {len(column) for column in undisturbed.history.values()}
    assert lengths == {sum(STEPS) + found["spline"]}
    edges = undisturbed.history["stage"] == "edges"
    assert np.isfinite(undisturbed.history["edge"][edges]).all()
    assert np.isnan(undisturbed.history["edge"][undisturbed.history["stage"] == "cube"]).all()


def test_another_seed_gives_another_volume(surface, undisturbed):
    other = parameterize(surface, tiny_config(), seed=4, device="cpu")
    assert not np.array_equal(other.volume.control_points, undisturbed.volume.control_points)


@pytest.mark.parametrize(("stage", "step"), [("S(2)", 1), ("cube", 8), ("edges", 5), ("spline", 5)])
def test_interrupted_and_resumed_is_undisturbed(surface, undisturbed, tmp_path, stage, step):
    def interrupt(state):
        if (state.stage, state.step) == (stage, step):
            raise KeyboardInterrupt

    options = {"seed": 3, "device": "cpu", "checkpoint_dir": tmp_path}
    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, tiny_config(), progress=interrupt, **options)
    steps = []
    resumed = parameterize(
        surface, tiny_config(), progress=lambda s: steps.append((s.stage, s.step)), resume=True, **options
    )
    same_result(undisturbed, resumed)
    assert ("S(2)", 1) not in steps  # it did go on, not start again


def test_without_a_damaged_checkpoint_the_run_goes_on_from_the_one_before(surface, undisturbed, tmp_path):
    options, steps = {"seed": 3, "device": "cpu", "checkpoint_dir": tmp_path}, []
    parameterize(surface, tiny_config(), **options)
    damaged = tmp_path / "spline.safetensors"
    damaged.write_bytes(b"nonsense")
    with pytest.raises(CheckpointError, match=r"spline\.safetensors: not a readable checkpoint .*; remove this file"):
        parameterize(surface, tiny_config(), resume=True, **options)
    damaged.unlink()
    resumed = parameterize(surface, tiny_config(), progress=lambda s: steps.append(s.stage), resume=True, **options)
    same_result(undisturbed, resumed)
    assert set(steps) == {"spline"}


def test_a_refinement_interrupted_and_resumed_is_undisturbed(surface, tmp_path):
    config = tiny_config().refined(tolerance=1e-9, max_control_points=7)
    undisturbed = parameterize(surface, config, seed=3, device="cpu")
    told = undisturbed.refinement
    assert told.levels[-1].control_points == undisturbed.volume.shape == undisturbed.quality.control_points
    assert "refine" in undisturbed.seconds and undisturbed.config == config
    options, rounds = {"seed": 3, "device": "cpu", "checkpoint_dir": tmp_path}, FIRM_ROUNDS + 1

    def interrupt(state):
        if state.stage == "spline" and state.step > config.spline.steps * rounds:  # in the second after the knots
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, config, progress=interrupt, **options)
    resumed = parameterize(surface, config, resume=True, **options)
    same_result(undisturbed, resumed)
    assert resumed.refinement == told
    assert all(np.array_equal(a, b) for a, b in zip(resumed.volume.knots, undisturbed.volume.knots, strict=True))
    with pytest.raises(CheckpointError, match=r"\(different: config\.refinement\.tolerance\)"):
        parameterize(surface, config.refined(1e-3, 7), resume=True, **options)


def test_progress_tells_every_step(surface, tmp_path):
    seen = []

    def stop_after_training(state):
        seen.append(state)
        if state.stage == "spline":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, tiny_config(), device="cpu", progress=stop_after_training)
    training = seen[:-1]
    assert [(s.stage, s.step) for s in training] == [
        (stage.name, k + 1) for stage in tiny_config().stages for k in range(stage.steps)
    ]
    assert all(s.seconds_left >= 0.0 for s in training) and seen[-1].seconds_left is None
    assert all(np.isfinite(s.loss) and s.folded >= 0 for s in seen)


def test_same_seed_same_volume_also_for_one_who_looks_at_the_mapped_surface(surface, undisturbed):
    looks = []

    def look(state):
        if state.mapped is not None:
            looks.append(state.mapped())

    same_result(undisturbed, parameterize(surface, tiny_config(), seed=np.int64(3), device="cpu", progress=look))
    assert len(looks) == sum(STEPS)
    own = [points[: len(surface.vertices)] for points in looks]
    assert np.abs(own[0] - surface.unit_vertices).max() < 0.5  # starts near the surface as placed
    assert not np.array_equal(own[0], own[-1]) and all(points.shape == looks[0].shape for points in looks)


def test_checkpoint_of_another_run_is_refused(surface, tmp_path):
    def interrupt(state):
        raise KeyboardInterrupt

    config = tiny_config()
    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, config, device="cpu", progress=interrupt, checkpoint_dir=tmp_path)

    def resume(mesh=surface, options=config, **more):
        parameterize(mesh, options, device="cpu", checkpoint_dir=tmp_path, resume=True, **more)

    with pytest.raises(CheckpointError, match=r"\(different: surface"):
        resume(replace(small_surface(3.0), sha256=surface.sha256))  # as another body of the same file
    with pytest.raises(
        CheckpointError,
        match=r"\(different: config\.spline\.steps, config\.stages, config\.steps_factor",
    ):
        resume(options=config.scaled(2.0))
    with pytest.raises(CheckpointError, match=r"\(different: seed"):
        resume(seed=1)
    with pytest.raises(CheckpointError, match=r"\(different: corners, seed"):
        resume(seed=1, corners=np.arange(8))


def hard_config(starts=2, easy_loss=1e-9):
    """The same options, with which every shape counts as hard to train."""
    config = tiny_config()
    return replace(config, starts=starts, train=replace(config.train, easy_loss=easy_loss))


@pytest.fixture(scope="module")
def few_shares():
    """Two rounds in which F grows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("parameterize.ways.growth.SHARES", (0.1, 1.0))
        yield


@pytest.fixture(scope="module")
def grown(surface, few_shares):
    """The map of a surface that counts as hard to train, and what was told on the way."""
    with TestCase().assertLogs("parameterize", "INFO") as told:
        result = parameterize(surface, hard_config(), seed=3, device="cpu")
    return result, told.output


def test_a_shape_that_is_hard_to_train_is_grown_after_the_first_stage(surface, undisturbed, grown):
    result, told = grown
    assert any("network: hard for the network; growing a map from a cube instead" in line for line in told)
    stages = result.history["stage"]
    assert [(stages == stage.name).sum() for stage in tiny_config().stages] == [STEPS[0], 0, 0, 0, 0]
    assert not np.array_equal(result.volume.control_points, undisturbed.volume.control_points)
    alone = parameterize(surface, hard_config(starts=1), seed=3, device="cpu")  # no other try: all stages are trained
    same_result(undisturbed, alone)
    assert (result.origin, alone.origin) == ("growth", "network")
    first, second = result.attempts
    assert (first.start, first.ending, first.rounds) == ("network", "hard for the network", {})
    assert (second.start, second.origin, second.rounds["grow"]) == ("growth", "growth", 2)
    assert second.unproved == len(result.certificate.unproved) and second.seconds.keys() == {"fit", *second.rounds}


@pytest.mark.usefixtures("few_shares")
def test_where_every_shape_counts_as_hard_nothing_is_trained(surface):
    result = parameterize(surface, hard_config(easy_loss=0.0), seed=3, device="cpu")
    assert set(result.history["stage"]) == {"spline"}
    assert "train" not in result.seconds and result.origin == "growth"
    assert [attempt.ending for attempt in result.attempts][0] == "not trained"


def test_a_hard_shape_with_given_corners_is_trained_to_the_end_which_the_log_says(surface, caplog):
    result = parameterize(surface, hard_config(), seed=3, device="cpu", corners=2.0 * turned(CORNERS) + [10.0, 0, -3.0])
    assert "hard for the network, and trained to the end: no other start may follow" in caplog.text
    assert [attempt.start for attempt in result.attempts] == ["network"]


@pytest.mark.usefixtures("few_shares")
def test_a_shape_is_judged_without_its_distortion(surface, undisturbed):
    first = undisturbed.history["stage"] == "S(2)"
    columns = [undisturbed.history[name][first] for name in ("folded", "loss", "arap")]
    _, loss, arap = min(zip(*columns, strict=True))
    seen = []

    def interrupt(state):
        if state.stage != "S(2)":
            seen.append(state.stage)
            raise KeyboardInterrupt

    for limit in (loss - 0.9 * arap, loss - 1.1 * arap):
        with pytest.raises(KeyboardInterrupt):
            parameterize(surface, hard_config(easy_loss=limit), seed=3, device="cpu", progress=interrupt)
    assert seen == ["S(1)", "layout"]  # trained on, and grown


def test_a_run_killed_after_the_look_at_a_hard_shape_resumes(surface, grown, tmp_path):
    def interrupt(state):
        if state.stage == "spline":
            raise KeyboardInterrupt

    options = {"seed": 3, "device": "cpu", "checkpoint_dir": tmp_path}
    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, hard_config(), progress=interrupt, **options)
    same_result(grown[0], parameterize(surface, hard_config(), resume=True, **options))


def test_given_corners_are_honoured(surface):
    points = 2.0 * turned(0.1 + 0.8 * CORNERS) + [10.0, 0.0, -3.0]
    rolled = points[[0, 2, 4, 6, 1, 3, 5, 7]]  # (u, v, w) -> (v, w, u): a third of a turn about the diagonal
    chosen = corner_vertices(surface, rolled)
    config = tiny_config()
    steps = (100, 50, 100)  # the stages that hold the corners and edges are added
    config = replace(
        config,
        network=NetworkConfig(width=32, modules=2, frequencies=4),
        train=replace(config.train, learning_rate=3e-3),
        stages=tuple(map(StageConfig, get_args(StageName), steps)),
        spline=replace(config.spline, rounds=1),
    )
    result = parameterize(surface, config, device="cpu", corners=rolled)
    assert np.linalg.norm(result.boundary.parameters[chosen] - CORNERS, axis=1).max() < 0.2
    training = result.history["stage"] != "spline"
    assert np.isfinite(result.history["cor"][training]).all()  # the corners pull from the first stage on


def test_bad_corners_are_refused(surface):
    far = np.argwhere(np.ones((2, 2, 2))) * 1000.0
    with pytest.raises(ValueError, match=r"corners: \(1000, 1000, 1000\) is .* away .* farther"):
        parameterize(surface, tiny_config(), corners=far)
    with pytest.raises(ValueError, match="8 vertex numbers or 8 points"):
        parameterize(surface, tiny_config(), corners=np.zeros((4, 3)))
    with pytest.raises(ValueError, match="8 vertex numbers or 8 points"):
        corner_vertices(surface, np.linspace(0.0, 7.0, 8))
    with pytest.raises(ValueError, match="between 0 and 199"):
        corner_vertices(surface, [0, 1, 2, 3, 4, 5, 6, 200])
    with pytest.raises(ValueError, match="same vertex"):
        corner_vertices(surface, [0, 1, 2, 3, 4, 5, 6, 6])
    with pytest.raises(ValueError, match="same vertex"):
        corner_vertices(surface, np.tile(surface.vertices[0], (8, 1)))
    with pytest.raises(ValueError, match="finite"):
        corner_vertices(surface, np.full((8, 3), np.nan))


def test_corner_points_take_the_nearest_vertices(surface):
    points = 2.0 * turned(CORNERS) + [10.0, 0.0, -3.0]
    gaps = np.linalg.norm(surface.vertices[:, None] - points, axis=2)
    assert corner_vertices(surface, points).tolist() == gaps.argmin(axis=0).tolist()
    assert corner_vertices(surface, np.arange(8, dtype=np.int32)).tolist() == list(range(8))


@pytest.mark.parametrize("most", [300, 2000])
def test_long_edges_add_so_many_points_at_most(surface, most):
    spline, own = replace(tiny_config().spline, control_points=30), len(surface.vertices)
    mesh = surface.unit_vertices, surface.faces, spline.longest_edge
    vertices, faces = subdivide_finely(*mesh, own + most)
    assert 0 < len(vertices) - len(surface.vertices) <= most
    edges = np.linalg.norm(vertices[faces] - vertices[faces[:, [1, 2, 0]]], axis=2)
    spans = 27 * edges.max()  # the length of the longest one
    assert spans > 1.0 and len(subdivide_finely(*mesh, own + MOST_POINTS)[0]) > 2000
    assert np.array_equal(vertices[: len(surface.vertices)], surface.unit_vertices)


def test_devices():
    with pytest.raises(ValueError, match="'tpu'.*auto, cpu or cuda"):
        choose_device("tpu")
    assert choose_device("cpu") == "cpu"
    if torch.cuda.is_available():
        assert choose_device("auto") == choose_device("cuda") == "cuda"
    else:
        assert choose_device("auto") == "cpu"
        with pytest.raises(ValueError, match="no CUDA device"):
            choose_device("cuda")


def test_precisions():
    assert choose_precision("float64") == choose_precision(torch.float64) == "float64"
    with pytest.raises(ValueError, match="'float16'.*float32 or float64"):
        choose_precision(torch.float16)


def test_arguments_of_the_wrong_kind_are_refused_with_the_remedy(surface):
    for other in (None, "bean"):
        with pytest.raises(TypeError, match=rf"surface .*{other}.*load_surface\(path\)"):
            parameterize(other)
    for other in ("fast", ""):
        with pytest.raises(TypeError, match=rf"config .*'{other}'.*preset\('fast'\)"):
            parameterize(surface, other)


def test_a_seed_of_any_size_is_taken(surface):
    def interrupt(state):
        raise KeyboardInterrupt

    for seed in (0, 2**62):
        with pytest.raises(KeyboardInterrupt):
            parameterize(surface, tiny_config(), seed=seed, device="cpu", progress=interrupt)


def test_a_rod_too_thin_for_a_lattice_is_refused_with_the_remedy():
    corners = np.array([[x, y, z] for x in (0.0, 1e-6) for y in (0.0, 1e-6) for z in (0.0, 1.0)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    rod = surface_from_arrays(corners, np.array([half for a, b, c, d in sides for half in ([a, b, c], [a, c, d])]))
    with pytest.raises(MeshError, match="too thin for the network: .*; scale its thickness up"):
        parameterize(rod, tiny_config(), seed=0)


def test_the_start_map_makes_a_cloud_round():
    cloud = np.random.default_rng(0).normal(size=(500, 3)) * [4.0, 1.0, 0.5]
    matrix = start_map(cloud)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    spread = np.cov((cloud @ matrix.T).T)
    assert spread == pytest.approx(np.trace(spread) / 3.0 * np.eye(3), abs=1e-9)
    assert np.allclose(matrix, matrix.T)


def test_the_result_tells_why_the_body_is_one_cube(undisturbed):
    assert undisturbed.decomposition.startswith("no handles, and a compact body: ")


def test_corners_are_refused_for_a_body_with_handles_and_for_several_blocks(surface):
    ring = surface_from_arrays(*torus(around=16, across=8)[1:])
    with pytest.raises(ValueError, match=r"corners are those of one cube, and this body has handles \(genus 1\)"):
        parameterize(ring, tiny_config(), corners=np.arange(8))
    with pytest.raises(ValueError, match="and several blocks are asked for: leave them out"):
        parameterize(surface, tiny_config().with_blocks(5), corners=np.arange(8))
