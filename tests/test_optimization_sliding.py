import numpy as np
import pytest
from shapes import rounded_cube
from wavy import NETS, as_volume, folded_over_edges, on_the_cube, wavy_control

from parameterize.cube.cube import snap
from parameterize.cube.flips import flipped
from parameterize.optimization.sliding import SlidingParameters

LONGEST = 0.5 / max(NETS.shapes[0])  # step of a slide


def parameters_at(start, triangles=((0, 1, 2),)):
    return SlidingParameters(NETS, start, triangles=np.array(triangles))


def distances(places, control, points):
    return np.linalg.norm(places.values(control) - points, axis=1)


def test_sliding_lowers_the_residuals():
    control = wavy_control()
    volume = as_volume(control)
    truth, cube_faces = on_the_cube(300)
    rng = np.random.default_rng(3)
    start = truth + 0.03 * rng.uniform(-1.0, 1.0, truth.shape)
    start = np.clip(start, 0.0, 1.0)
    start[np.arange(300), cube_faces // 2] = cube_faces % 2
    points, places = volume(truth), parameters_at(start)
    places.place(start, cube_faces)  # points clipped to an edge stay on their face
    before = distances(places, control, points)
    for _ in range(6):
        places.slide(control, points)
    after = distances(places, control, points)
    assert after.max() < 1e-4 * before.max()
    assert_on_the_cube(places)


def test_a_slide_is_no_longer_than_half_a_control_point():
    control = wavy_control()
    start, cube_faces = on_the_cube(200)
    points, places = start[::-1].copy(), parameters_at(start)
    places.slide(control, points)
    same = places.cube_faces == cube_faces
    assert same.mean() > 0.8
    steps = np.linalg.norm(places.parameters - start, axis=1)
    assert steps[same].max() <= LONGEST + 1e-12 and steps[same].max() > 0.9 * LONGEST
    assert_on_the_cube(places)


def test_points_beyond_reach_stay():
    control = wavy_control()
    start, cube_faces = on_the_cube(200)
    points, places = start[::-1].copy(), parameters_at(start)
    before = distances(places, control, points)
    reach = float(np.median(before))
    places.slide(control, points, reach=reach)
    moved = (places.parameters != start).any(axis=1)
    assert moved[before < reach].mean() > 0.5 and not moved[before > reach].any()


def test_no_slide_leads_away():
    control = wavy_control()
    start, cube_faces = on_the_cube(200)
    points, places = start[::-1].copy(), parameters_at(start)
    before = distances(places, control, points)
    for _ in range(3):
        places.slide(control, points)
        after = distances(places, control, points)
        assert (after <= before + 1e-12).all()
        before = after
    assert_on_the_cube(places)


def test_no_slide_leads_to_a_place_that_faces_away():
    start, face, goal = np.array([[1.0, 0.5, 0.99]]), np.array([1]), np.array([[0.99, 0.5, 1.02]])
    for normals, expected in ((None, 5), (np.array([[1.0, 0.0, 1.0]]), 5), (np.array([[1.0, 0.0, -1.0]]), 1)):
        places = parameters_at(start)
        places.place(start, face)
        places.slide(wavy_control(0.0), goal, normals)
        assert places.cube_faces.tolist() == [expected] and (expected == 5 or np.array_equal(places.parameters, start))


def test_a_slide_that_keeps_the_layout_turns_no_triangle():
    start, triangles = rounded_cube(300, power=40.0)
    start = snap(start)
    control = wavy_control()
    points = as_volume(control)(snap(start + 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, start.shape)))
    for keep_layout in (False, True):
        places = parameters_at(start, triangles)
        before = distances(places, control, points)
        for _ in range(5):
            places.slide(control, points, keep_layout=keep_layout)
        assert flipped(places.parameters, triangles).any() != keep_layout
        assert distances(places, control, points).mean() < 0.9 * before.mean()
        assert_on_the_cube(places)


def test_relaxing_turns_flipped_triangles_back():
    start, triangles = rounded_cube(300, power=40.0)
    start = snap(start)
    assert not flipped(start, triangles).any()
    tangled = start.copy()
    a, b, c = triangles[0]
    tangled[a] = snap(start[[a]] + 1.5 * (start[[b]] + start[[c]] - 2.0 * start[[a]]) / 2.0)[0]  # past the edge bc
    assert flipped(tangled, triangles).any()
    places = parameters_at(tangled, triangles)
    places.relax(100)
    assert not flipped(places.parameters, triangles).any()
    assert np.abs(places.parameters - tangled).max(axis=1).astype(bool).mean() < 0.2  # the others stay
    assert_on_the_cube(places)


def assert_on_the_cube(places):
    rows = np.arange(len(places.parameters))
    assert np.array_equal(places.parameters[rows, places.cube_faces // 2], places.cube_faces % 2)
    assert places.parameters.min() >= 0.0 and places.parameters.max() <= 1.0


@pytest.mark.parametrize(
    ("parameters", "face", "expected", "expected_face"),
    [
        ([1.0, 0.4, 0.6], 1, [1.0, 0.4, 0.6], 1),  # nothing to do
        ([1.0, 1.1, 0.6], 1, [0.9, 1.0, 0.6], 3),  # from u1 over the edge to v1
        ([0.0, 1.1, 0.6], 0, [0.1, 1.0, 0.6], 3),  # from u0 over the edge to v1
        ([0.3, 0.4, 0.0], 4, [0.3, 0.4, 0.0], 4),
        ([-0.2, 0.4, 0.0], 4, [0.0, 0.4, 0.2], 0),  # from w0 to u0
        ([-0.2, 1.1, 1.0], 5, [0.0, 1.0, 0.8], 0),  # over a corner: the farther side wins, the other is clipped
        ([0.2, 1.0, 1.0], 5, [0.2, 1.0, 1.0], 5),  # on an edge: stays
    ],
)
def test_folding_over_edges(parameters, face, expected, expected_face):
    found, faces = folded_over_edges(NETS, np.array([parameters]), np.array([face]))
    assert found[0].tolist() == pytest.approx(expected) and faces.tolist() == [expected_face]


def test_folding_leaves_its_arguments_alone():
    parameters, faces = np.array([[1.0, 1.1, 0.6]]), np.array([1])
    folded_over_edges(NETS, parameters, faces)
    assert parameters.tolist() == [[1.0, 1.1, 0.6]] and faces.tolist() == [1]


def test_a_relaxation_that_leaves_flips_is_dropped(monkeypatch):
    """A point is pushed across its neighbours; relaxing, made to spread the tangle here, must not be what is kept."""
    points, triangles = rounded_cube(6, power=40.0)
    start = snap(points)
    tangled = start.copy()
    tangled[triangles[0, 0]] = start[triangles[-1, 0]]
    control = wavy_control(0.0)
    monkeypatch.setattr(SlidingParameters, "unflip", lambda self: None)
    monkeypatch.setattr("parameterize.cube.flips.untangle", lambda *_: np.roll(start, 7, axis=0))
    places = parameters_at(tangled, triangles)
    found = places.at_closest_points(control, as_volume(control)(tangled), 2, 5)
    assert flipped(tangled, triangles).any()
    assert np.allclose(found.parameters, tangled)


def test_a_fixed_parameter_stays_and_the_point_slides_along_its_edge():
    control = wavy_control()
    volume = as_volume(control)
    start = np.array([[0.3, 1.0, 1.0], [0.4, 0.0, 1.0], [0.5, 1.0, 0.3]])
    goal = np.array([[0.5, 1.0, 1.0], [0.2, 0.0, 1.0], [0.5, 1.0, 0.6]])
    fixed = np.array([[0, 1, 1], [0, 1, 1], [1, 0, 0]], dtype=bool)
    places = SlidingParameters(NETS, start, np.array([3, 2, 3]), fixed=fixed)
    for _ in range(20):
        places.slide(control, volume(goal) + [0.0, 0.02, 0.02])
    assert np.array_equal(places.parameters[fixed], start[fixed])
    assert np.abs(places.parameters - goal).max() < 0.05


def test_a_point_on_an_edge_that_carries_it_stops_at_the_corner():
    fixed = np.array([[False, True, True]])
    ended = folded_over_edges(NETS, np.array([[1.1, 1.0, 1.0]]), np.array([3]), fixed)
    assert ended[0].tolist() == [[1.0, 1.0, 1.0]] and ended[1].tolist() == [3]


def test_a_point_on_a_rim_passes_the_corner():
    fixed = np.array([[False, False, True]])
    parameters, faces = folded_over_edges(NETS, np.array([[1.1, 1.0, 1.0]]), np.array([3]), fixed)
    assert parameters[0] == pytest.approx([1.0, 0.9, 1.0]) and faces.tolist() == [1]
