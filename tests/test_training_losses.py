import numpy as np
import pytest
import torch

from parameterize.training import losses
from parameterize.training.losses import determinant
from parameterize.training.training_points import OFFSETS

CELL = 0.1


def stencil_points(count=7):
    """Stencils (count, 19, 3) around random centres."""
    centres = np.random.default_rng(0).uniform(0.2, 0.8, (count, 1, 3))
    return torch.as_tensor(centres + CELL * OFFSETS)


def affine(matrix, points):
    return points @ torch.as_tensor(np.asarray(matrix, dtype=float)).T + 0.3


MATRIX = np.array([[1.5, 0.2, 0.0], [0.1, 0.8, -0.3], [0.0, 0.4, 1.1]])


def arap_of_inverse(matrix):
    """det * sum (1 / sigma - 1)^2."""
    sigma = np.linalg.svd(matrix, compute_uv=False)
    return np.linalg.det(matrix) * ((1.0 / sigma - 1.0) ** 2).sum()


def test_stencil_jacobian_is_exact_for_affine_maps():
    jacobian = losses.stencil_jacobian(affine(MATRIX, stencil_points()), CELL)
    assert jacobian.permute(2, 0, 1).numpy() == pytest.approx(np.stack([MATRIX] * 7))
    assert determinant(jacobian).numpy() == pytest.approx(np.linalg.det(MATRIX))


def test_identity_costs_nothing():
    points = stencil_points()
    jacobian = losses.stencil_jacobian(points, CELL)
    det = determinant(jacobian)
    assert float(losses.distortion(jacobian, det)) == pytest.approx(0.0, abs=1e-12)
    assert float(losses.fairness(points, CELL)) == pytest.approx(0.0, abs=1e-20)
    assert float(losses.bijectivity(det)) == 0.0


def test_distortion_of_an_affine_map():
    jacobian = losses.stencil_jacobian(affine(MATRIX, stencil_points()), CELL)
    found = losses.distortion(jacobian, determinant(jacobian))
    assert float(found) == pytest.approx(arap_of_inverse(MATRIX))
    stretch = losses.stencil_jacobian(affine(np.diag([2.0, 1.0, 1.0]), stencil_points()), CELL)
    assert float(losses.distortion(stretch, determinant(stretch))) == pytest.approx(2.0 * 0.25)


def test_a_rotation_is_no_distortion_and_a_reflection_is():
    c, s = np.cos(0.7), np.sin(0.7)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for matrix, sign in ((rotation, 1.0), (np.diag([1.0, 1.0, -1.0]), -1.0)):
        jacobian = losses.stencil_jacobian(affine(matrix, stencil_points()), CELL)
        det = determinant(jacobian)
        value = float(losses.distortion(jacobian, det))
        assert (value < 1e-12) if sign > 0.0 else (value > 1.0)


def test_bijectivity_by_hand():
    det = torch.tensor([0.3, 0.1, 0.0, -0.4])
    assert float(losses.bijectivity(det)) == pytest.approx((0.1**2 + 0.5**2) / 4.0)


def test_distortion_gradient():
    points = (stencil_points(2) + 0.02 * torch.sin(9.0 * stencil_points(2))).requires_grad_()

    def value(mapped):
        jacobian = losses.stencil_jacobian(mapped, CELL)
        return losses.distortion(jacobian, determinant(jacobian))

    assert torch.autograd.gradcheck(value, points, eps=1e-6, atol=1e-4)


def test_fairness_of_a_quadratic_map_is_exact():
    hessians = np.random.default_rng(1).normal(size=(3, 3, 3))
    hessians = hessians + hessians.transpose(0, 2, 1)
    x = stencil_points()
    mapped = 0.5 * torch.einsum("rsa,cab,rsb->rsc", x, torch.as_tensor(hessians), x)
    assert float(losses.fairness(mapped, CELL)) == pytest.approx((hessians**2).sum())


def test_distance_and_normals_by_hand():
    points = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    target = torch.tensor([[0.0, 2.0, 0.0], [1.0, 0.0, 1.0]])
    assert float(losses.distance(points, target)) == pytest.approx(2.5)
    triangle = torch.tensor([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]])
    normal = losses.triangle_normals(triangle)
    assert normal.tolist() == [[0.0, 0.0, 1.0]]
    assert float(losses.normal_difference(normal, normal, 100.0)) == 0.0
    assert float(losses.normal_difference(normal, -normal, 100.0)) == pytest.approx(4.0 + 100.0)
    across = torch.tensor([[1.0, 0.0, 0.0]])
    assert float(losses.normal_difference(normal, across, 100.0)) == pytest.approx(2.0)


def test_a_triangle_without_area_has_a_finite_gradient():
    corners = torch.zeros(1, 3, 3, requires_grad=True)
    losses.star_shape(corners, losses.triangle_normals(corners)).backward()
    assert bool(torch.isfinite(corners.grad).all())


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
    return torch.as_tensor(np.array(triangles))


def test_star_shape_is_zero_on_the_cube_and_positive_on_an_inverted_face():
    cube = cube_triangles()
    assert float(losses.star_shape(cube, losses.triangle_normals(cube))) == 0.0
    dented = cube.clone()
    dented[2:4, :, 0] = 0.2  # the face u = 1 pushed beyond the centre
    value = losses.star_shape(dented, losses.triangle_normals(dented))
    arm = np.array([0.2, 0.0, 0.0]) - 0.5  # both triangles start at the square's first corner
    assert float(value) == pytest.approx(2.0 / 12.0 * (0.3 / np.linalg.norm(arm)) ** 2)


def test_edge_path_by_hand():
    mapped = torch.tensor([[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [1.0, 0.0, 0.0]])
    target = torch.tensor([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]])
    following = torch.tensor([[0, 1], [1, 2]])
    cosine = 0.5 / np.hypot(0.5, 0.1)
    expected = 0.01 / 3.0 + 1e-3 * (2.0 - 2.0 * cosine)  # both steps point 0.1 off over 0.5
    assert float(losses.edge_path(mapped, target, following)) == pytest.approx(expected, rel=1e-5)
    assert float(losses.edge_path(target, target, following)) == 0.0
