"""The map of a body with handles: several blocks from its surface, certified, resumed, refused in one line."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from block_starts import torus
from conftest import told

import parameterize.ways.blocks as ways
from iga_nn.cli.commands import main
from iga_nn.samples import write_obj
from parameterize.config import preset
from parameterize.run import parameterize
from parameterize.spline.body import Body
from parameterize.surface.surface import surface_from_arrays


@pytest.fixture(scope="module")
def ring():
    """A torus whose mesh is coarse."""
    _, vertices, faces = torus(around=36, across=14)
    return surface_from_arrays(10.0 * vertices, faces, "ring")


@pytest.fixture(scope="module")
def options():
    return {"config": preset("fast").scaled(0.4), "device": "cpu"}


@pytest.fixture(scope="module")
def undisturbed(ring, options):
    return parameterize(ring, **options)


@pytest.mark.slow
def test_a_ring_becomes_certified_blocks_in_its_own_units(ring, undisturbed):
    assert isinstance(undisturbed.volume, Body) and undisturbed.origin == "blocks"
    assert undisturbed.certificate.verdict == "certified" and undisturbed.quality.boundary_check.injective
    assert undisturbed.certificate.volume == pytest.approx(ring.volume, rel=0.02)
    boundary = undisturbed.boundary
    found = undisturbed.volume.points(boundary.patches, boundary.parameters)
    assert np.linalg.norm(found - ring.vertices, axis=1).max() < 0.01 * np.ptp(ring.vertices, axis=0).max()
    (attempt,) = undisturbed.attempts
    assert attempt.start == "blocks" and attempt.rounds["approach"] == len(ways._FACE_SHARES)


@pytest.mark.slow
def test_interrupted_and_resumed_gives_the_same_blocks(ring, options, undisturbed, tmp_path):
    def interrupt(state):
        if state.step > 2 * options["config"].spline.steps:  # in the third round
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        parameterize(ring, progress=interrupt, checkpoint_dir=tmp_path, **options)
    steps = []
    resumed = parameterize(
        ring, checkpoint_dir=tmp_path, resume=True, progress=lambda state: steps.append(state.step), **options
    )
    assert steps[0] > 2 * options["config"].spline.steps  # it went on; the soft rounds count from one again
    for one, other in zip(undisturbed.volume, resumed.volume, strict=True):
        assert np.array_equal(one.control_points, other.control_points)


@pytest.mark.parametrize(
    ("blocks", "says"),
    [
        ("1", "ring: genus 1: one cube is never mapped one-to-one onto a body with handles; allow more"),
        ("2", "ring: the skeleton needs 4 blocks, and at most 2 are allowed: allow more"),
        ("0", "blocks must be auto (None in Python) or a whole number from 1 on, got 0"),
    ],
)
def test_blocks_that_cannot_be_are_refused_in_one_line(ring, in_folder, capsys, blocks, says):
    write_obj(ring, "ring.obj")
    assert main(["parameterize", "ring.obj", "--blocks", blocks, "--out", "out"]) == 2
    assert " ".join(capsys.readouterr().err.split()).endswith(says)


def test_a_run_of_blocks_is_reported(ring, undisturbed, in_folder, few_distances, monkeypatch):
    """The command asks for what is there already: the same surface and options."""

    def known(surface, config, *, when_made=None, **_):
        assert np.array_equal(surface.vertices, ring.vertices) and np.array_equal(surface.faces, ring.faces)
        assert config == undisturbed.config
        return told(undisturbed, when_made)

    monkeypatch.setattr("parameterize.run.parameterize", known)
    write_obj(ring, "ring.obj")
    arguments = ["run", "poisson", "ring.obj", "--exact=x*y", "--refine", "0", "--steps-factor", "0.4", "--out", "out"]
    assert main(arguments) == 0
    report = json.loads((in_folder / "out" / "report.json").read_text())
    assert report["input"]["genus"] == 1 and report["parameterization"]["bijective"] == "certified"
    assert len(report["parameterization"]["patches"]) == 4


@pytest.mark.slow
def test_large_surfaces_of_bodies_with_handles_are_fitted_on_a_copy(monkeypatch, options):
    from parameterize.surface import decimation

    monkeypatch.setattr(decimation, "MOST_FITTED", 2000)
    monkeypatch.setattr(decimation, "FITTED", 1000)
    mesh = trimesh.creation.torus(1.0, 0.35, major_sections=60, minor_sections=24)
    surface = surface_from_arrays(mesh.vertices, mesh.faces, "fine")
    result = parameterize(surface, **(options | {"config": replace(options["config"], blocks=9)}))
    assert len(result.boundary.vertices) == len(surface.vertices)
    found = result.volume.points(result.boundary.patches, result.boundary.parameters)
    assert np.linalg.norm(found - surface.vertices, axis=1).max() < 0.02
