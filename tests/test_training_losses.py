import numpy as np
import pytest
from shapes import rounded_cube

from parameterize.config import NetworkConfig
from parameterize.quality.rotations import cofactors_and_determinants
from parameterize.training import losses
from parameterize.training.losses import BoundaryData, EdgePaths, Objective, Stage, StageWeights
from parameterize.training.network import InverseMap
from parameterize.training.training_points import OFFSETS, Stencils, TriangleSampler, stencils

CELL = 0.1
MATRIX = np.array([[1.5, 0.2, 0.0], [0.1, 0.8, -0.3], [0.0, 0.4, 1.1]])


def stencil_points(count=7):
    """Stencils around random centres, each with nodes of its own."""
    centres = np.random.default_rng(0).uniform(0.2, 0.8, (count, 1, 3))
    nodes = (centres + CELL * OFFSETS).reshape(-1, 3)
    return Stencils(nodes, np.arange(len(nodes)).reshape(count, -1), CELL)


def derivatives(mapping, count=7):
    """First derivatives (3, 3, r) and second ones (6, r, 3) of a map at stencils."""
    found = stencil_points(count)
    both = (found.differences @ mapping(found.nodes)).reshape(9, count, 3)
    return np.ascontiguousarray(np.moveaxis(both[:3], 2, 0)), both[3:]


def affine(matrix):
    return lambda points: points @ np.asarray(matrix, dtype=float).T + 0.3


def arap(matrix):
    jacobian, _ = derivatives(affine(matrix))
    value, _ = losses.distortion(jacobian, *cofactors_and_determinants(jacobian))
    return value


def slopes_by_differences(value, at, step=1e-6):
    """The slopes of a function of an array, by central differences."""
    found = np.zeros(at.size)
    for k, move in enumerate(step * np.eye(at.size)):
        up, down = (value(at + side * move.reshape(at.shape)) for side in (1.0, -1.0))
        found[k] = (up - down) / (2.0 * step)
    return found.reshape(at.shape)


def arap_of_inverse(matrix):
    """det * sum (1 / sigma - 1)^2."""
    sigma = np.linalg.svd(matrix, compute_uv=False)
    return np.linalg.det(matrix) * ((1.0 / sigma - 1.0) ** 2).sum()


def test_stencil_jacobian_is_exact_for_affine_maps():
    jacobian, second = derivatives(affine(MATRIX))
    assert np.moveaxis(jacobian, 2, 0) == pytest.approx(np.stack([MATRIX] * 7))
    assert second == pytest.approx(0.0, abs=1e-11)


def test_identity_costs_nothing():
    terms, folded = losses.inner_terms(*derivatives(affine(np.eye(3))))
    assert folded == 0
    assert [value for value, _ in terms.values()] == pytest.approx([0.0] * 3, abs=1e-12)


def test_distortion_of_an_affine_map():
    assert arap(MATRIX) == pytest.approx(arap_of_inverse(MATRIX))
    assert arap(np.diag([2.0, 1.0, 1.0])) == pytest.approx(2.0 * 0.25)


def test_a_rotation_is_no_distortion_and_a_reflection_is():
    c, s = np.cos(0.7), np.sin(0.7)
    assert arap([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) < 1e-12
    assert arap(np.diag([1.0, 1.0, -1.0])) > 1.0


def test_bijectivity_by_hand():
    value, slopes = losses.bijectivity(np.array([0.3, 0.1, 0.0, -0.4]))
    assert value == pytest.approx((0.1**2 + 0.5**2) / 4.0)
    assert slopes == pytest.approx([0.0, 0.0, -0.05, -0.25])


@pytest.mark.parametrize("size", [1.0, 0.3])  # the second has determinants below the least
def test_distortion_gradient(size):
    matrices = np.ascontiguousarray((size * (np.eye(3) + 0.2 * np.random.default_rng(2).normal(size=(4, 3, 3)))).T)

    def value(at):
        return losses.distortion(at, *cofactors_and_determinants(at))[0]

    _, slopes = losses.distortion(matrices, *cofactors_and_determinants(matrices))
    assert slopes == pytest.approx(slopes_by_differences(value, matrices), rel=1e-5, abs=1e-7)


def test_fairness_of_a_quadratic_map_is_exact():
    hessians = np.random.default_rng(1).normal(size=(3, 3, 3))
    hessians = hessians + hessians.transpose(0, 2, 1)
    _, second = derivatives(lambda x: 0.5 * np.einsum("sa,cab,sb->sc", x, hessians, x))
    value, slopes = losses.fairness(second)
    assert value == pytest.approx((hessians**2).sum())
    assert slopes == pytest.approx(slopes_by_differences(lambda at: losses.fairness(at)[0], second), abs=1e-5)


def test_distance_and_normals_by_hand():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    target = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 1.0]])
    assert losses.distance(points, target)[0] == pytest.approx(2.5)
    normal, _ = losses.triangle_normals(np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]]))
    assert normal.tolist() == [[0.0, 0.0, 1.0]]
    assert losses.normal_difference(normal, normal, 100.0)[0] == 0.0
    assert losses.normal_difference(normal, -normal, 100.0)[0] == pytest.approx(4.0 + 100.0)
    across = np.array([[1.0, 0.0, 0.0]])
    assert losses.normal_difference(normal, across, 100.0)[0] == pytest.approx(2.0)


def test_a_triangle_without_area_has_finite_slopes():
    terms = losses.bound_terms(np.zeros((1, 3, 3)), np.zeros((1, 3, 3)), 100.0)
    assert all(np.isfinite(slopes).all() for _, slopes in terms.values())


def test_slopes_of_the_surfaces_terms():
    rng = np.random.default_rng(3)
    triangles, goal = 0.5 + rng.normal(size=(2, 6, 3, 3))
    for name, (_, slopes) in losses.bound_terms(triangles, goal, 10.0).items():
        expected = slopes_by_differences(lambda at, n=name: losses.bound_terms(at, goal, 10.0)[n][0], triangles)
        assert slopes == pytest.approx(expected, rel=1e-5, abs=1e-7), name


@pytest.mark.parametrize("is_cut", [False, True])
def test_the_gradient_of_the_loss_is_that_of_differences(is_cut):
    """With goals that do not move: those of the faces once the surface is cut, or without the surface's terms."""
    vertices, faces = rounded_cube(200)
    rng = np.random.default_rng(4)
    network = InverseMap(NetworkConfig(width=6, modules=2, frequencies=2), rng, "cpu", "float64")
    network.parameters["last.weight"] = network.there(0.2 * rng.normal(size=(3, 6)))
    paths = EdgePaths(np.arange(9), rng.random((9, 3)), np.stack([np.arange(8), np.arange(1, 9)], axis=1))
    labels = rng.integers(0, 6, len(faces)) if is_cut else None
    boundary = BoundaryData(vertices, faces, TriangleSampler(vertices, faces, 50), np.arange(8), labels, paths)
    weights = {"dist": 10.0, "norm": 1.0} if is_cut else {"dist": 0.0, "norm": 0.0}
    stage = Stage("cube", StageWeights(**{"bij": 10.0, "star": 5.0, "cor": 2.0, "edge": 3.0, **weights}))
    objective = Objective(network, stencils(vertices, faces, 0.3))

    def loss():
        return objective(stage, boundary, np.random.default_rng(5))

    gradient = loss().gradient()
    for name, values in network.parameters.items():
        direction = network.there(rng.normal(size=values.shape))
        ends = []
        for side in (1e-6, -1e-6):
            network.parameters[name] = values + side * direction
            ends.append(loss().value)
        network.parameters[name] = values
        assert float((gradient[name] * direction).sum()) == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4), name


def cube_triangles():
    """The 12 triangles of the unit cube, outward: (12, 3, 3)."""
    triangles = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for side in (0.0, 1.0):
            square = np.full((4, 3), side)
            square[:, a], square[:, b] = [0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]
            order = ([0, 1, 2], [0, 2, 3]) if side else ([0, 2, 1], [0, 3, 2])
            triangles += [square[o] for o in order]
    return np.array(triangles)


def star(triangles):
    value, _, _ = losses.star_shape(triangles[:, 0] - 0.5, losses.triangle_normals(triangles)[0])
    return value


def test_star_shape_is_zero_on_the_cube_and_positive_on_an_inverted_face():
    cube = cube_triangles()
    assert star(cube) == 0.0
    dented = cube.copy()
    dented[2:4, :, 0] = 0.2  # the face u = 1 pushed beyond the centre
    arm = np.array([0.2, 0.0, 0.0]) - 0.5  # both triangles start at the square's first corner
    assert star(dented) == pytest.approx(2.0 / 12.0 * (0.3 / np.linalg.norm(arm)) ** 2)


def test_edge_path_by_hand():
    mapped = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [1.0, 0.0, 0.0]])
    target = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]])
    following = np.array([[0, 1], [1, 2]])
    cosine = 0.5 / np.hypot(0.5, 0.1)
    expected = 0.01 / 3.0 + 1e-3 * (2.0 - 2.0 * cosine)  # both steps point 0.1 off over 0.5
    value, slopes = losses.edge_path(mapped, target, following)
    assert value == pytest.approx(expected, rel=1e-5)
    assert slopes == pytest.approx(
        slopes_by_differences(lambda at: losses.edge_path(at, target, following)[0], mapped), abs=1e-8
    )
    assert losses.edge_path(target, target, following)[0] == 0.0
