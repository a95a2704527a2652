"""Every file is read back by a program that did not write it, at 50 random points."""

from __future__ import annotations

import numpy as np
import pytest

from iga_nn.formats import export
from parameterize.bspline import open_uniform_knots
from parameterize.volume import BSplineVolume

POINTS = np.random.default_rng(7).random((50, 3))


def volume_of(degrees, knots):
    """Irregular control points: an order mistaken anywhere shows."""
    n = tuple(len(k) - p - 1 for k, p in zip(knots, degrees, strict=True))
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, m) for m in n], indexing="ij"), axis=-1)
    return BSplineVolume(degrees, knots, grid + 0.03 * np.random.default_rng(3).normal(size=grid.shape))


VOLUMES = {
    "cubic": volume_of((3, 3, 3), (open_uniform_knots(7, 3), open_uniform_knots(5, 3), open_uniform_knots(6, 3))),
    "mixed": volume_of(
        (2, 3, 1),
        (
            np.array([0, 0, 0, 0.2, 0.5, 0.5, 1, 1, 1]),
            open_uniform_knots(5, 3),
            np.array([0, 0, 0.3, 0.9, 1, 1]),
        ),
    ),
    "one span": volume_of((1, 2, 3), (open_uniform_knots(2, 1), open_uniform_knots(3, 2), open_uniform_knots(4, 3))),
}


@pytest.fixture(params=VOLUMES)
def volume(request):
    return VOLUMES[request.param]


def spans_at(volume, points):
    """Element of each point, counted with u fastest, and the coordinates in it."""
    numbers, local, step = np.zeros(len(points), dtype=int), np.empty_like(points), 1
    for axis, knots in enumerate(volume.knots):
        breaks = np.unique(knots)
        i = np.searchsorted(breaks, points[:, axis], side="right") - 1
        local[:, axis] = (points[:, axis] - breaks[i]) / (breaks[i + 1] - breaks[i])
        numbers += step * i
        step *= len(breaks) - 1
    return numbers, local


def test_mfem_reads_its_mesh(volume, tmp_path):
    mfem = pytest.importorskip("mfem.ser")
    pytest.importorskip("splinepy")
    mesh = mfem.Mesh(str(export(volume, "mfem", tmp_path / "volume")), 1, 0)
    read = []
    for element, where in zip(*spans_at(volume, POINTS), strict=True):
        point = mfem.IntegrationPoint()
        point.Set3(*where)
        read.append(np.array(mesh.GetElementTransformation(int(element)).Transform(point)))
    assert np.abs(np.array(read) - volume(POINTS)).max() < 1e-12
    assert mesh.GetNE() == np.prod([len(np.unique(k)) - 1 for k in volume.knots])


def test_mfem_knows_the_faces_by_their_attributes(tmp_path):
    mfem = pytest.importorskip("mfem.ser")
    pytest.importorskip("splinepy")
    volume = VOLUMES["one span"]
    mesh = mfem.Mesh(str(export(volume, "mfem", tmp_path / "volume")), 1, 0)
    middle = mfem.IntegrationPoint()
    middle.Set2(0.5, 0.5)
    for element in range(mesh.GetNBE()):
        axis, side = {1: (2, 0), 2: (2, 1), 3: (1, 0), 4: (0, 1), 5: (1, 1), 6: (0, 0)}[mesh.GetBdrAttribute(element)]
        where = np.full((1, 3), 0.5)
        where[0, axis] = side
        read = np.array(mesh.GetBdrElementTransformation(element).Transform(middle))
        assert np.abs(read - volume(where)[0]).max() < 1e-12
