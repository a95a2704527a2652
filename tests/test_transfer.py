"""A large surface is laid out and fitted on a copy, and everything is measured on the surface itself."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from small_run import small_surface, tiny_config

from parameterize.quality.distances import two_sided
from parameterize.run import corner_vertices, parameterize
from parameterize.surface import collapses, decimation
from parameterize.surface.surface import surface_from_arrays

pytestmark = pytest.mark.usefixtures("few_distances")


@pytest.fixture(scope="module")
def large():
    """A surface of sixteen times as many faces, on which the coarse one's are exact."""
    coarse = small_surface()
    vertices, faces = igl.upsample(coarse.vertices, coarse.faces, 2)
    groups = {"top": np.flatnonzero(np.isin(np.arange(len(faces)) // 16, coarse.groups["top"]))}
    return surface_from_arrays(vertices, faces, "pillow", groups=groups)


@pytest.fixture
def small_limits(monkeypatch):
    monkeypatch.setattr(decimation, "MOST_FITTED", 2000)
    monkeypatch.setattr(decimation, "FITTED", 400)


@pytest.fixture
def carried_result(large, small_limits):
    large.__dict__.pop("fitted", None)
    return parameterize(large, tiny_config(), seed=3, device="cpu")


def test_all_vertices_are_carried_over_and_the_part_is_the_surface(large, carried_result):
    result, n = carried_result, len(large.vertices)
    copy, notice = large.fitted
    assert len(copy.faces) <= 400 and notice.endswith(f"measured on all {len(large.faces)}")
    assert np.array_equal(result.boundary.vertices[:n], large.vertices)
    part = result.boundary.part
    assert np.array_equal(part.faces, large.faces) and np.array_equal(part.vertices[:n], large.vertices)
    assert part.area(part.group("top")) == pytest.approx(large.part.area(large.groups["top"]))
    assert len(result.boundary.cube_faces) == len(result.boundary.faces) < len(large.faces)
    assert result.quality.mesh_vertices == n


def test_carried_vertices_are_as_near_as_the_surface_is(large, carried_result):
    result, n = carried_result, len(large.vertices)
    gaps = np.linalg.norm(result.volume(result.boundary.parameters[:n]) - large.vertices, axis=1)
    nearest = two_sided(result.volume, large.vertices, large.faces).mesh_to_spline.summary()
    assert gaps.max() < 1.5 * nearest.max and np.sqrt((gaps**2).mean()) < 1.2 * nearest.rms


def test_corners_are_those_of_the_surface(large, small_limits):
    large.__dict__.pop("fitted", None)
    low, high = large.bbox
    given = corner_vertices(
        large, [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    result = parameterize(large, tiny_config(), seed=3, device="cpu", corners=given)
    assert result.quality.mesh_vertices == len(large.vertices)


def test_a_small_surface_is_its_own_copy():
    surface = small_surface()
    assert surface.fitted == (surface, "")


def test_what_cannot_be_reduced_is_fitted_as_it_is(small_limits, monkeypatch):
    def torn(*_, **__):
        return np.eye(4, 3), np.array([[0, 1, 2]])

    surface = surface_from_arrays(*igl.upsample(small_surface().vertices, small_surface().faces, 2))
    monkeypatch.setattr(collapses, "collapsed", torn)
    monkeypatch.setattr(decimation.igl, "qslim", torn)
    copy, notice = surface.fitted
    assert copy is surface and "which takes long" in notice
