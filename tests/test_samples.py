import numpy as np
import pytest

from iga_nn.samples import SAMPLES, sample, write_obj
from parameterize.surface.surface import load_surface


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_pass_the_gate_without_remarks(name):
    surface = sample(name)
    assert surface.name == name
    assert surface.notices == ()
    assert 1500 <= len(surface.vertices) <= 4000
    assert len(surface.faces) == 2 * len(surface.vertices) - 4  # Euler, genus 0


@pytest.mark.parametrize("name", SAMPLES)
def test_triangles_are_well_shaped(name):
    surface = sample(name)
    corners = surface.vertices[surface.faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (lengths.max(axis=1) / lengths.min(axis=1)).max() < 4.0


def test_samples_are_the_same_every_time():
    assert sample("seashell").sha256 == sample("seashell").sha256


def test_volumes_known_by_hand():
    assert sample("cube").volume == pytest.approx(1.0)
    assert sample("cube").center == pytest.approx([0.5, 0.5, 0.5], abs=1e-3)
    exact = 4.0 / 3.0 * np.pi * 1.5 * 1.0 * 0.7
    assert 0.99 * exact < sample("ellipsoid").volume < exact  # inscribed


def test_the_seashell_is_a_graph_over_angle_and_height():
    """Its faces, seen from the axis at their own height, all point away: no two of them meet."""
    surface = sample("seashell")
    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    normal, center = np.cross(b - a, c - a), (a + b + c) / 3.0
    away = np.sum(normal[:, :2] * center[:, :2], axis=1)
    apart = np.hypot(*center[:, :2].T) > 0.05  # beside the two poles
    assert np.all(away[apart] > 0)
    assert not np.all(np.sum(normal * center, axis=1) > 0)  # but no ball: its whorls overhang as seen from the middle


def test_written_and_read_again_is_the_same(tmp_path):
    surface = sample("bean")
    write_obj(surface, tmp_path / "bean.obj")
    again = load_surface(tmp_path / "bean.obj")
    assert np.array_equal(again.vertices, surface.vertices)
    assert np.array_equal(again.faces, surface.faces)
    assert again.notices == ()


def test_unknown_names_are_told_the_samples():
    with pytest.raises(
        ValueError, match="no sample 'teapot': choose one of bean, bumpy_ball, cube, ellipsoid, seashell"
    ):
        sample("teapot")
