import numpy as np
import pytest
from block_bodies import box, glued, map_of, rod, sampled, straight_block, surface_fit

from parameterize.optimization.reassignment import reassign

THICKNESS = 0.02


def plate(turn=0):
    """A thin plate of two blocks, whose two sides are far nearer to each other than samples on one side."""
    halves = [((0.0, 0.0, 0.0), (0.5, 1.0, THICKNESS)), ((0.5, 0.0, 0.0), (1.0, 1.0, THICKNESS))]
    corners = [box(*half) for half in halves]
    return map_of(glued(*[straight_block(c, k * turn, 3) for k, c in enumerate(corners)]))


def normals_at(spline, places):
    """Unit normals of straight blocks at places, outward."""
    window = places.window.derivatives(spline.control)
    normals = np.cross(window[1], window[2])
    normals *= np.where(places.cube_faces % 2 == 1, 1.0, -1.0)[:, None]
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("turn", [0, 7])
def test_a_point_gets_the_side_that_faces_as_it_does_though_the_other_is_nearer(turn):
    """The surface is the plate moved up by more than its thickness: its lower side is nearer to the blocks' upper."""
    spline, surface = plate(turn), sampled(plate(), 9)
    goals = surface.points + [0.0, 0.0, 1.5 * THICKNESS]
    fit = surface_fit(spline, goals, surface.triangles)
    away = ((goals[:, :2] > 0.1) & (goals[:, :2] < 0.9)).all(axis=1)  # from the rim, where all near samples lie
    sides = away & (np.abs(fit.normals[:, 2]) > 0.99)
    assert sides.sum() == 4 * 7 * 7
    assert normals_at(spline, fit.sliding)[sides] == pytest.approx(fit.normals[sides], abs=1e-9)
    aside = np.abs(fit.sliding.values(spline.control) - goals)[sides, :2].max(axis=0)
    assert (aside <= np.array([1.0 / 48.0, 1.0 / 24.0]) + 1e-12).all()  # half of the samples' distances


def test_with_first_all_places_are_new_and_otherwise_those_that_are_close_stay():
    spline = rod(7, lengths=(1.0, 2.0))
    surface = sampled(spline, 8)
    fit = surface_fit(spline, surface.points, surface.triangles)
    places = fit.sliding
    inside = np.isin(surface.parameters, (0.0, 1.0)).sum(axis=1) == 1  # of a face, on none of its edges
    assert not np.allclose(places.parameters[inside], surface.parameters[inside])  # samples lie in between
    assert np.array_equal(places.cube_faces[inside], surface.sample_faces[inside])
    parameters, faces = surface.parameters.copy(), surface.sample_faces.copy()
    astray = np.flatnonzero(inside)[::7]
    parameters[astray], faces[astray] = surface.parameters[astray[::-1]], surface.sample_faces[astray[::-1]]
    places.place(parameters, faces)
    far = np.linalg.norm(fit.residuals(spline.control), axis=1) > 0.3
    assert 5 < far.sum() < 0.5 * len(far)
    reassign(fit, spline.control)
    assert np.array_equal(places.parameters[~far], parameters[~far])
    assert np.array_equal(places.cube_faces[far], surface.sample_faces[far])
    assert np.linalg.norm(fit.residuals(spline.control), axis=1).max() < 0.15
    places.place(surface.parameters, surface.sample_faces)
    reassign(fit, spline.control, first=True)
    assert (places.parameters != surface.parameters).any(axis=1)[inside].all()


def test_places_lie_on_faces_of_the_boundary():
    spline = rod(7, lengths=(1.0, 2.0))
    surface = sampled(spline, 6)
    fit = surface_fit(spline, 1.3 * surface.points, surface.triangles)
    faces, parameters = fit.sliding.cube_faces, fit.sliding.parameters
    assert spline.nets.exposed[faces].all()
    assert np.array_equal(parameters[np.arange(len(faces)), faces % 6 // 2], faces % 2)
