"""What lies beyond the edges of faces, on bodies where three and four blocks lie around an edge."""

import numpy as np
import pytest
from block_bodies import BODIES, fan, rod, uniform_nets
from wavy import folded_over_edges

from parameterize.optimization.adjacent_faces import next_faces
from parameterize.optimization.sliding import SlidingParameters
from parameterize.quality.distortion import own_boxes

TURNS = (0, 5, 7, 11)


@pytest.fixture(params=[(name, turn) for name in BODIES for turn in TURNS], ids=str)
def spline(request):
    name, turn = request.param
    return BODIES[name](turn)


def edges(nets):
    """The faces of the boundary with the directions and sides of their edges."""
    for face in np.flatnonzero(nets.exposed).tolist():
        for direction in {0, 1, 2} - {face % 6 // 2}:
            yield from ((face, direction, side) for side in (0, 1))


def on_edge(spline, face, direction, side, along):
    """Points of an edge of a face in space."""
    axis = face % 6 // 2
    parameters = np.empty((len(along), 3))
    parameters[:, axis], parameters[:, direction], parameters[:, 3 - axis - direction] = face % 2, side, along
    return spline.patch(face // 6)(parameters)


def test_an_edge_is_the_same_curve_on_the_next_face(spline):
    table, along = next_faces(spline.nets), np.array([0.1, 0.2, 0.6])
    for face, direction, side in edges(spline.nets):
        other, inwards, end, reverse = table[face, direction, side]
        assert spline.nets.exposed[other] and other != face
        there = on_edge(spline, other, inwards, end, 1.0 - along if reverse else along)
        assert there == pytest.approx(on_edge(spline, face, direction, side, along), abs=1e-12)


def test_there_and_back_is_the_identity(spline):
    table = next_faces(spline.nets)
    for face, direction, side in edges(spline.nets):
        other, inwards, end, reverse = table[face, direction, side].tolist()
        assert table[other, inwards, end].tolist() == [face, direction, side, reverse]


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_two_faces_at_an_edge_inside_a_fan_are_those_of_its_ends(count):
    """Between the first and the last of blocks around an edge lie the others, whose faces there are glued."""
    table = next_faces(fan(count, angle=90.0 * count).nets)
    first, last = 2, 6 * (count - 1)  # v0 of the first and u0 of the last block, at its edge u = v = 0
    assert table[first, 0, 0].tolist() == ([last, 1, 0, 0])


def test_one_cube_has_the_other_face_at_each_edge():
    table = next_faces(uniform_nets((2, 2, 2)))
    for face, direction, side in edges(uniform_nets((2, 2, 2))):
        assert table[face, direction, side].tolist() == [2 * direction + side, face // 2, face % 2, 0]


def places_beyond(spline, seed=0):
    """Parameters on faces of the boundary, a little beyond one edge of each, and these edges."""
    rng, parameters, faces, crossed = np.random.default_rng(seed), [], [], []
    for face, direction, side in edges(spline.nets):
        place = rng.uniform(0.1, 0.9, 3)
        place[face % 6 // 2], place[direction] = face % 2, side + 0.05 * (2 * side - 1)
        parameters.append(place)
        faces.append(face)
        crossed.append((face, direction, side))
    return np.array(parameters), np.array(faces), crossed


def test_a_step_over_an_edge_goes_on_at_the_same_height_of_it(spline):
    """Twice over the same edge leads back, for all blocks taken as cubes."""
    table = next_faces(spline.nets)
    parameters, faces, crossed = places_beyond(spline)
    there, found = folded_over_edges(spline.nets, parameters, faces)
    for row, (face, direction, side) in enumerate(crossed):
        other, inwards, end, reverse = table[face, direction, side]
        assert found[row] == other
        assert abs(there[row, inwards] - end) == pytest.approx(0.05)
        along, across = parameters[row, 3 - face % 6 // 2 - direction], other % 6 // 2
        assert there[row, across] == other % 2
        assert there[row, 3 - across - inwards] == pytest.approx(1.0 - along if reverse else along)
        there[row, inwards] += 0.1 * (2 * end - 1)  # out of the next face, over the edge again
    back, again = folded_over_edges(spline.nets, there, found)
    assert np.array_equal(again, faces)
    for row, (_, direction, side) in enumerate(crossed):
        parameters[row, direction] -= 0.1 * (2 * side - 1)
    assert back == pytest.approx(parameters, abs=1e-12)


@pytest.mark.parametrize("turn", [0, 5, 7, 11, 17])
def test_a_slide_from_block_to_block_stays_at_its_place_in_space(turn):
    """Blocks of different lengths in a row: a step goes on beyond the interface as far as it was to go."""
    spline = rod(turn, lengths=(1.0, 2.0, 0.5))
    nets = spline.nets
    rng, count = np.random.default_rng(1), 40
    parameters = rng.uniform(0.2, 0.8, (count, 3))
    parameters[:, 0], parameters[:, 1] = rng.uniform(0.97, 1.0, count), 1.0
    faces = np.full(count, 3)  # v1 of the first block, which is not turned
    places = SlidingParameters(nets, parameters, faces)
    places.measure_in(own_boxes(spline.body))
    goals = spline.patch(0)(parameters) + np.column_stack([np.full(count, 0.04), np.zeros((count, 2))])
    places.slide(spline.control, goals)
    assert (places.cube_faces // 6 == 1).all()
    assert places.values(spline.control) == pytest.approx(goals, abs=1e-6)  # steps are damped a little
