"""Maps of exact blocks, from a surface of planes to a volume."""

from dataclasses import replace

import numpy as np
import pytest
from plane_bodies import BODIES, arrays, prism

import iga_nn
from parameterize.config import RefinementConfig, preset
from parameterize.run import parameterize
from parameterize.spline.body import Body
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.strategy import NETWORK, PLANES, SHARP, STACKS, WAYS, first_way

QUICK = preset("fast").with_control_points(6)


def surface_of(name):
    return surface_from_arrays(*arrays(name), name)


def task_of(name, config=QUICK, corners=None):
    return MappingTask(surface_of(name), config, 0, "cpu", "float32", corners, {}, {})


def first(task):
    return first_way(task, WAYS)[0]


@pytest.mark.parametrize("name", ["frustum", "L", "tunnel"])
def test_the_map_of_a_body_that_planes_bound_is_exact_and_certified(name, few_distances):
    result = parameterize(surface_of(name), QUICK)
    count = BODIES[name][1]
    assert result.decomposition == f"bounded by planes: {count} exact block{'s' * (count > 1)}"
    assert (result.origin, [one.ending for one in result.attempts]) == ("planes", ["exact"])
    assert result.certificate.verdict == "certified" and result.quality.boundary_check.injective is True
    assert result.quality.relative_distance.max < 1e-12 and result.quality.boundary.as_given.max < 1e-12
    assert isinstance(result.volume, Body) == (count > 1)
    if count == 1:
        assert result.volume.shape == (6, 6, 6)
        assert np.array_equal(np.sort(result.boundary.cube_faces), np.repeat(np.arange(6), 2))


def test_the_options_and_the_corners_of_a_user_come_first():
    assert first(task_of("L")) is PLANES
    assert first(task_of("frustum", QUICK.with_blocks(1))) is PLANES
    assert first(task_of("L", QUICK.with_blocks(1))) is NETWORK  # an L is no cube, and has a hollow
    assert first(task_of("frustum", corners=np.arange(8))) is SHARP


def test_refinement_finds_nothing_to_do(few_distances):
    result = parameterize(surface_of("wedge"), replace(QUICK, refinement=RefinementConfig(1e-6)))
    assert result.refinement.stopped == "tolerance met" and len(result.refinement.levels) == 1


def test_a_tessellated_shaft_becomes_stacked_blocks():
    surface = surface_from_arrays(*arrays(prism([(np.cos(t), np.sin(t)) for t in np.arange(80) * np.pi / 40], 2.0)))
    assert first(MappingTask(surface, QUICK, 0, "cpu", "float32", None, {}, {})) is STACKS
    result = parameterize(surface, QUICK)
    assert (result.origin, [one.ending for one in result.attempts]) == ("stacks", ["laid"])
    assert result.certificate.verdict == "certified" and result.quality.as_dict()["boundary_injective"]
    assert result.decomposition.startswith("a stack of extrusions: 5 blocks, within ")
    assert result.quality.relative_distance.max < 3e-4  # what chords are off a circle of 80 corners


def test_a_run_with_a_load_on_a_face(in_folder):
    vertices, faces = arrays("L")
    ends = np.flatnonzero(np.ptp(vertices[faces][:, :, 0], axis=1) + np.abs(vertices[faces][:, 0, 0] - 3.0) < 1e-9)
    surface = surface_from_arrays(vertices, faces, groups={"end": ends})
    result = parameterize(surface, QUICK)
    law = iga_nn.Elasticity(young=10.0, fix="ny > 0.99 and y > 2.9", load={"group:end": (0, -1.0, 0)})
    balance = iga_nn.solve(result.volume, law.on_surface(result.boundary.part)).report.balance
    assert balance.reactions["fix 'ny > 0.99 and y > 2.9'"] == pytest.approx([0.0, 2.0, 0.0], abs=1e-6)


def test_a_run_has_no_training_to_draw(in_folder, few_distances):
    mapping, poisson = iga_nn.MapOptions(control_points=6), iga_nn.PoissonOptions(refine=(0,))
    report = iga_nn.run("poisson", "cube", "out", mapping=mapping, poisson=poisson).report
    assert report["parameterization"]["decomposition"] == "bounded by planes: 1 exact block"
    assert "history.png" not in report.get("not_drawn", {}) and not (in_folder / "out" / "history.png").exists()
    assert len(set(report["estimate"]["seconds"])) == 1  # no training, and no rounds, that may be easy or hard
