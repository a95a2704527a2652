"""A closed surface on the sphere: one-to-one whatever the shape, and with derivatives that are right."""

import numpy as np
import pytest
from shapes import ball

from parameterize.checkpoint import Checkpoints
from parameterize.cube.sphere import _STEPS, _relaxed, _tangents, _Triangles, lay_on_sphere


def turned_over(directions, faces):
    """Which triangles do not face outwards, seen from the sphere's centre."""
    return np.linalg.det(directions[faces]) <= 0.0


def horseshoe(count=1200, length=7.0):
    """A rod of radius about 0.6 whose middle line is bent to three quarters of a circle."""
    points, faces = ball(count)
    angle = 0.75 * np.pi * points[:, 0]
    radius = length / 4.0 + 0.6 * points[:, 1]
    return np.stack([radius * np.sin(angle), radius * np.cos(angle), 0.6 * points[:, 2]], axis=1), faces


def thorn(count=1200):
    """A ball with one long thin thorn: what a plain layout squeezes to nothing."""
    points, faces = ball(count)
    return points * (1.0 + 6.0 * np.exp(-40.0 * (1.0 - points[:, :1]))), faces


def rod(rings=60, around=8, length=12.0):
    """A straight rod of radius 1/2, its mesh a stack of rings of a few points each: a plain layout shrinks fast."""
    angle = 2.0 * np.pi * (np.arange(around) + 0.5 * np.arange(rings)[:, None]) / around
    height = np.broadcast_to(np.linspace(0.0, length, rings)[:, None], angle.shape)
    points = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), height], axis=-1).reshape(-1, 3)
    ring = np.arange(rings * around).reshape(rings, around)
    beside, first, last = np.roll(ring, -1, axis=1), len(points), len(points) + 1
    triangles = [
        (ring[:-1], beside[:-1], ring[1:]),
        (beside[:-1], beside[1:], ring[1:]),
        (beside[:1], ring[:1], np.full((1, around), first)),
        (ring[-1:], beside[-1:], np.full((1, around), last)),
    ]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in triangles])
    return np.concatenate([points, [[0.0, 0.0, 0.0], [0.0, 0.0, length]]]), faces


@pytest.mark.parametrize("shape", [ball, horseshoe, thorn])
def test_no_triangle_is_turned_over_and_the_mesh_stays(shape):
    vertices, faces = shape(1200)
    layout = lay_on_sphere(vertices, faces)
    assert not turned_over(layout.places, layout.faces).any()
    assert np.linalg.norm(layout.places, axis=1) == pytest.approx(1.0)
    assert np.array_equal(layout.points[: len(vertices)], vertices)
    again = lay_on_sphere(vertices, faces)
    assert np.array_equal(again.places, layout.places)


def test_the_sphere_keeps_its_areas():
    vertices, faces = ball(800)
    layout = lay_on_sphere(vertices, faces)
    before, after = (np.linalg.det(x[layout.faces]) for x in (layout.points, layout.places))
    assert np.median(after / before) == pytest.approx(1.0, abs=0.02)
    assert np.percentile(after / before, [1, 99]) == pytest.approx([1.0, 1.0], abs=0.1)


def test_a_thorn_gets_the_room_that_its_area_asks_for():
    vertices, faces = thorn()
    layout = lay_on_sphere(vertices, faces)
    points = layout.points[layout.faces]
    cross = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    area, room = np.linalg.norm(cross, axis=1), np.linalg.det(layout.places[layout.faces])
    tip = points[:, :, 0].mean(axis=1) > 3.0
    share, given = area[tip].sum() / area.sum(), room[tip].sum() / room.sum()
    assert share > 0.02 and 0.3 < given / share < 3.0


def test_a_long_rod_is_not_squeezed_to_nothing_at_its_ends():
    vertices, faces = rod()
    layout = lay_on_sphere(vertices, faces)
    assert not turned_over(layout.places, layout.faces).any()
    points = layout.points[layout.faces]
    area = np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)
    room = np.linalg.det(layout.places[layout.faces])
    tenth = np.minimum(points[:, :, 2].mean(axis=1) / 1.2, 9.0).astype(int)
    shares = np.bincount(tenth, room) / room.sum() / (np.bincount(tenth, area) / area.sum())
    assert (shares > 0.15).all() and (shares < 2.0).all()


def test_first_and_second_derivatives():
    vertices, faces = horseshoe(60)
    layout = lay_on_sphere(vertices, faces)
    triangles, places = _Triangles(layout.points, layout.faces), layout.places
    rng, h = np.random.default_rng(0), 1e-4
    step = rng.normal(size=(len(places), 2))
    tangents = _tangents(places)

    def energies(t):
        moved = places + t * np.einsum("nca,na->nc", tangents, step)
        return triangles.energies(moved / np.linalg.norm(moved, axis=1, keepdims=True))

    slopes, bends = triangles.derivatives(places, tangents)
    local = step[layout.faces].reshape(-1, 6)
    difference = (energies(h) - energies(-h)) / (2.0 * h)
    assert (slopes * local).sum(axis=1) == pytest.approx(difference, rel=1e-3, abs=1e-3)
    second = (energies(h) - 2.0 * energies(0.0) + energies(-h)) / h**2
    positive = np.einsum("mi,mij,mj->m", local, bends, local)
    assert (positive >= second - 1e-3 * np.abs(second).max()).all()  # negative directions are left out
    near = np.isclose(positive, second, rtol=1e-2)
    assert near.mean() > 0.2  # where there are none, they are equal


def test_the_energy_falls_and_no_step_turns_a_triangle_over():
    vertices, faces = ball(300)
    rough = vertices + 0.03 * np.random.default_rng(1).normal(size=vertices.shape)
    rough /= np.linalg.norm(rough, axis=1, keepdims=True)
    assert not turned_over(rough, faces).any()
    triangles = _Triangles(vertices, faces)
    relaxed = _relaxed(rough, triangles)
    assert triangles.energies(relaxed).sum() < triangles.energies(rough).sum()
    assert not turned_over(relaxed, faces).any()


@pytest.mark.parametrize(
    ("rings", "around", "length"), [pytest.param(300, 8, 150.0, marks=pytest.mark.slow), (40, 30, 100.0)]
)
def test_a_needle_is_laid_out_whole_without_a_warning(rings, around, length):
    """Its plain layout shrinks to less than the numbers can tell apart: to triangles of no area."""
    vertices, faces = rod(rings, around, length)
    with np.errstate(all="raise", under="ignore"):
        layout = lay_on_sphere(vertices, faces)
    assert not turned_over(layout.places, layout.faces).any()
    energies = _Triangles(layout.points, layout.faces).energies(layout.places)
    assert np.isfinite(energies).all()
    assert energies.sum() < 2.0 * 8.0 * np.pi * length  # 8 pi is that of a sphere


def test_triangles_that_the_numbers_cannot_tell_apart_have_infinite_energy_and_no_warning():
    vertices, faces = ball(300)
    triangles = _Triangles(vertices, faces)
    squeezed = vertices.copy()
    squeezed[faces[0]] = vertices[faces[0, 0]]  # to a single point
    with np.errstate(all="raise"):
        energies = triangles.energies(squeezed)
        assert np.isfinite(triangles.energies(vertices)).all()
    touched = np.isin(faces, faces[0]).sum(axis=1) >= 2
    assert np.isinf(energies[touched]).all()
    assert np.isfinite(energies[~np.isin(faces, faces[0]).any(axis=1)]).all()
    assert np.array_equal(_relaxed(squeezed, triangles), squeezed)


def test_each_step_is_told_and_may_be_the_last():
    vertices, faces = horseshoe(400)
    told = []
    lay_on_sphere(vertices, faces, told.append)
    assert [now.step for now in told] == list(range(1, len(told) + 1)) and len(told) > 2
    assert {(now.stage, now.steps) for now in told} == {("layout", _STEPS)}
    assert np.all(np.diff([now.loss for now in told]) < 0.0)
    assert all(now.seconds_left is None for now in told)  # nobody knows how many steps a surface takes

    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lay_on_sphere(vertices, faces, stop)


def test_steps_that_are_interrupted_are_not_taken_again(tmp_path, monkeypatch):
    vertices, faces = horseshoe(400)
    told = []
    whole = lay_on_sphere(vertices, faces, told.append)

    def stop(now):
        if now.step == 3:
            raise KeyboardInterrupt

    def kept(resume):
        return Checkpoints(tmp_path, {}, resume=resume)

    with pytest.raises(KeyboardInterrupt):
        lay_on_sphere(vertices, faces, stop, kept(False))
    monkeypatch.setattr("parameterize.cube.sphere._halves", lambda *_: pytest.fail("cut again"))
    after = []
    for rest in (list(range(4, len(told) + 1)), []):  # the second one finds the layout finished
        found = lay_on_sphere(vertices, faces, after.append, kept(True))
        assert [now.step for now in after] == rest
        assert np.array_equal(found.places, whole.places) and np.array_equal(found.points, whole.points)
        after.clear()
