"""BSplineVolume: values, derivatives, refinement, faces, the file."""

import numpy as np
import pytest

from parameterize.spline.body import Body
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

CUBE = np.array([[i, j, k] for i in (0.0, 1.0) for j in (0.0, 1.0) for k in (0.0, 1.0)])


CUBIC = [0, 0, 0, 0, 1, 1, 1, 1]


def make_volume(seed=0, degrees=(3, 2, 1), shape=(6, 5, 4)):
    knots = tuple(open_uniform_knots(n, p) for n, p in zip(shape, degrees, strict=True))
    rows = [greville(k, p) for k, p in zip(knots, degrees, strict=True)]
    points = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    return BSplineVolume(degrees, knots, points + 0.1 * np.random.default_rng(seed).standard_normal(points.shape))


def points_inside(n=50):
    return np.random.default_rng(5).uniform(0.02, 0.98, (n, 3))


def test_identity():
    row = greville(open_uniform_knots(6, 3), 3)
    volume = BSplineVolume.uniform(np.stack(np.meshgrid(row, row, row, indexing="ij"), axis=-1))
    x = points_inside()
    np.testing.assert_allclose(volume(x), x, atol=1e-14)
    np.testing.assert_allclose(volume.jacobian(x), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-13)
    np.testing.assert_allclose(volume.hessian(x), 0.0, atol=1e-10)


def test_corners_of_the_cube_are_corner_control_points():
    volume = make_volume()
    expected = volume.control_points[np.ix_([0, -1], [0, -1], [0, -1])].reshape(8, 3)
    np.testing.assert_allclose(volume(CUBE), expected, atol=1e-14)


def test_jacobian_and_hessian_agree_with_differences():
    volume = make_volume(degrees=(3, 3, 3), shape=(7, 6, 5))
    x, step = points_inside(), 1e-5
    jacobian, hessian = volume.jacobian(x), volume.hessian(x)
    for b in range(3):
        shift = step * np.eye(3)[b]
        np.testing.assert_allclose(jacobian[:, :, b], (volume(x + shift) - volume(x - shift)) / (2 * step), atol=1e-7)
        slope = (volume.jacobian(x + shift) - volume.jacobian(x - shift)) / (2 * step)
        np.testing.assert_allclose(hessian[..., b], slope, atol=1e-5)
    np.testing.assert_array_equal(hessian, np.swapaxes(hessian, 2, 3))


def test_points_outside_of_the_cube_are_refused():
    volume = make_volume()
    assert np.isfinite(volume([[1.0 + 1e-12, 0.0, 0.5]])).all()
    for outside in ([1.5, 0.0, 0.0], [0.0, -1e-6, 0.0], [0.5, np.nan, 0.5]):
        with pytest.raises(ValueError, match="points are parameters from 0 to 1"):
            volume([[0.5, 0.5, 0.5], outside])


def test_grid_agrees_with_points():
    volume = make_volume()
    u, v, w = np.linspace(0, 1, 4), np.array([0.3]), np.linspace(0.1, 0.9, 3)
    x = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(volume.grid(u, v, w).reshape(-1, 3), volume(x), atol=1e-14)
    np.testing.assert_allclose(volume.grid_jacobian(u, v, w).reshape(-1, 3, 3), volume.jacobian(x), atol=1e-12)


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_refinement_is_exact(levels):
    volume, x = make_volume(), points_inside()
    fine = volume.refined(levels)
    spans = [len(np.unique(k)) - 1 for k in fine.knots]
    assert spans == [3 * 2**levels] * 3
    np.testing.assert_allclose(fine(x), volume(x), atol=1e-13)
    np.testing.assert_allclose(fine.jacobian(x), volume.jacobian(x), atol=1e-11)
    with pytest.raises(ValueError, match="at least 0, got -1"):
        volume.refined(-1)


def test_faces():
    volume = make_volume()
    assert volume.face(0, 0).shape == (5, 4, 3) and volume.face(2, 1).shape == (6, 5, 3)
    np.testing.assert_array_equal(volume.face(1, 1), volume.control_points[:, -1])


def test_transformed():
    volume, x = make_volume(), points_inside()
    moved = volume.transformed(2.5, [1.0, -2.0, 3.0])
    np.testing.assert_allclose(moved(x), 2.5 * volume(x) + np.array([1.0, -2.0, 3.0]), atol=1e-13)
    np.testing.assert_allclose(moved.jacobian(x), 2.5 * volume.jacobian(x), atol=1e-12)


def parts(**change):
    volume = make_volume()
    given = {"degrees": volume.degrees, "knots": volume.knots, "control_points": volume.control_points}
    return given | change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"degrees": (3, 2)}, "three degrees"),
        ({"control_points": np.zeros((6, 5, 4))}, "control_points must have shape"),
        ({"control_points": np.full((6, 5, 4, 3), np.inf)}, "finite"),
        ({"control_points": np.full((6, 5, 4, 3), -1.1e100)}, "exceed 1e\\+100"),
        ({"control_points": np.zeros((6, 5, 4, 3), complex)}, "control_points must be real numbers, got complex128"),
        ({"control_points": np.zeros((6, 5, 4, 3), bool)}, "control_points must be real numbers, got bool"),
        ({"knots": (open_uniform_knots(6, 3) + 0j, *make_volume().knots[1:])}, "knots must be real numbers, got comp"),
        ({"control_points": np.zeros((6, 6, 4, 3))}, "direction v: 6 control points of degree 2 need 9 knots"),
        (
            {"knots": (2.0 * open_uniform_knots(6, 3), *make_volume().knots[1:])},
            "direction u: knots must run from 0 to 1",
        ),
        ({"degrees": (2, 2, 1)}, "must be repeated 3 times, not more"),
    ],
)
def test_parts_that_do_not_fit(change, message):
    with pytest.raises(ValueError, match=message):
        BSplineVolume(**parts(**change))


def test_uniform_refuses_complex_control_points():
    with pytest.raises(ValueError, match="control_points must be real numbers, got complex128"):
        BSplineVolume.uniform(np.zeros((4, 4, 4, 3), complex))


def test_save_and_load(tmp_path):
    volume = make_volume()
    volume.save(tmp_path / "volume.npz")
    loaded = BSplineVolume.load(tmp_path / "volume.npz")
    assert loaded.degrees == (3, 2, 1)
    np.testing.assert_array_equal(loaded.control_points, volume.control_points)
    for ours, theirs in zip(loaded.knots, volume.knots, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert [p.name for p in tmp_path.iterdir()] == ["volume.npz"]


def stored(**change):
    volume = make_volume()
    named = dict(zip(("knots_u", "knots_v", "knots_w"), volume.knots, strict=True))
    return {"degrees": np.array(volume.degrees), **named, "control_points": volume.control_points} | change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"control_points": np.array([None, "x"], dtype=object)}, r"volume\.npz: .*allow_pickle"),
        ({"degrees": np.array([3.0, 2.0, 1.0])}, r"volume\.npz: degrees must be three integers"),
        ({"degrees": np.array([3, 2])}, r"volume\.npz: degrees must be three integers"),
        ({"knots_v": np.array(["a"])}, r"volume\.npz"),
        ({"knots_v": make_volume().knots[1] + 0j}, r"volume\.npz: knots must be real numbers"),
        ({"knots_v": np.zeros(8)}, r"volume\.npz: the knot vector is not open"),
        ({"control_points": np.full((6, 5, 4, 3), np.nan)}, r"volume\.npz: control_points must be finite"),
    ],
)
def test_bad_files_are_refused(tmp_path, change, message):
    np.savez(tmp_path / "volume.npz", **stored(**change))
    with pytest.raises(ValueError, match=message):
        BSplineVolume.load(tmp_path / "volume.npz")


def test_truncated_and_missing_files_are_refused(tmp_path):
    path = tmp_path / "volume.npz"
    with pytest.raises(FileNotFoundError):
        BSplineVolume.load(path)
    make_volume().save(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ValueError, match=r"volume\.npz: not a readable"):
        BSplineVolume.load(path)


def test_a_function_of_the_degree_is_met_exactly():
    def place(u, v, w):
        return u + 0.2 * v**3 * w, v**2 + u * w, 2.0 * w**3

    volume = BSplineVolume.from_function(place, (4, 6, 5))
    x = points_inside()
    np.testing.assert_allclose(volume(x), np.stack(place(*x.T), axis=-1), atol=1e-13)
    assert volume.shape == (4, 6, 5) and volume.degrees == (3, 3, 3)


def test_a_smooth_function_is_met_with_the_order_of_the_degree():
    def place(u, v, w):
        return u, v + 0.2 * np.sin(3.0 * u), 0.5 + 0.0 * w + w

    x = points_inside()
    errors = [np.abs(BSplineVolume.from_function(place, n)(x) - np.stack(place(*x.T), -1)).max() for n in (11, 19)]
    assert errors[0] / errors[1] > 2.0**3.5  # spans of 1/8 and 1/16


@pytest.mark.exact
@pytest.mark.parametrize("control_points", [4, 5, 8, (5, 8, 13), 40])
@pytest.mark.parametrize("ends", [(0.1, 1.0), (-0.3, 0.7), (1e6 + 0.1, 1e6 + 1.3)])
def test_plane_faces_of_a_function_stay_in_their_planes_to_the_last_bit(control_points, ends):
    a, b = ends
    volume = BSplineVolume.from_function(
        lambda u, v, w: (a * (1 - u) + b * u, a * (1 - v * v) + b * v * v, np.where(w == 1.0, b, a + 0.01 * w)),
        control_points,
    )
    for axis in range(3):
        across = np.moveaxis(volume.control_points[..., axis], axis, 0)
        assert np.all(across[0] == a) and np.all(across[-1] == b)


@pytest.mark.parametrize(
    ("function", "how", "says"),
    [
        (lambda u, v, w: (u, v), {}, "must return three values, x, y and z; it returned 2"),
        (lambda u, v, w: None, {}, "it returned None"),
        (lambda u, v, w: (u, v, w), {"control_points": (4, 4)}, r"a whole number, or three of them, got \(4, 4\)"),
        (lambda u, v, w: (u, v, w), {"control_points": 4.5}, "a whole number, or three of them, got 4.5"),
        (lambda u, v, w: (u, v, np.log(w)), {}, "finite numbers"),
        (lambda u, v, w: (u, v, u[0]), {"control_points": (4, 5, 6)}, "shape"),
        (lambda u, v, w: (u, v, w), {"control_points": 3}, "degree 3 needs at least 4 control points, got 3"),
        (lambda u, v, w: (u, v, "w"), {}, "values of function must be real numbers"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_a_function_that_is_no_volume_is_refused(function, how, says):
    with pytest.raises(ValueError, match=says):
        BSplineVolume.from_function(function, **how)


@pytest.mark.parametrize(
    ("degrees", "knots", "says"),
    [
        (3, (CUBIC,) * 3, "three degrees, then three knot vectors, then its control points"),
        ((3, 3, 3), None, "three degrees, then three knot vectors, then its control points"),
        ((3.5, 3, 3), (CUBIC,) * 3, r"degrees must be whole numbers, got \(3.5, 3, 3\)"),
        (("3", 3, 3), (CUBIC,) * 3, "degrees must be whole numbers"),
    ],
)
def test_degrees_and_knots_of_another_kind_are_refused(degrees, knots, says):
    with pytest.raises(ValueError, match=says):
        BSplineVolume(degrees, knots, np.zeros((4, 4, 4, 3)))


def test_a_divided_volume_is_the_same_map_in_parts():
    volume = make_volume()
    parts = volume.divided(u=[0.5, 0.2], w=[1 / 3])
    assert len(parts) == 6
    where = np.random.default_rng(0).uniform(size=(20, 3))
    ends = [(0.0, 0.2), (0.2, 0.5), (0.5, 1.0)]
    for number, part in enumerate(parts):
        low, high = (np.array([ends[number // 2][i], i, [(0, 1 / 3), (1 / 3, 1)][number % 2][i]]) for i in (0, 1))
        assert part(where) == pytest.approx(volume(low + where * (high - low)), abs=1e-14)
    assert len(Body.from_patches(parts).interfaces) == 7


@pytest.mark.parametrize("cuts", [[0.0], [1.0], [0.5, 0.5], [np.nan], [-1.0]])
def test_cuts_outside_of_the_cube_are_refused(cuts):
    with pytest.raises(ValueError, match="cuts must be different parameters between 0 and 1"):
        make_volume().divided(v=cuts)
