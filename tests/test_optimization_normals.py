import numpy as np
import pytest
import torch

from parameterize.optimization.normals import AlignmentPenalty, alignment_penalty
from parameterize.optimization.operators import ControlRows
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import Correspondence
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets
from parameterize.surface.geometry import vertex_normals

FLOOR = 0.3
NETS = ControlNets(3, ((open_uniform_knots(6, 3),) * 3,))


def random_penalty(points=40, controls=50):
    rng = np.random.default_rng(0)
    indices = np.stack([rng.choice(controls, 16, replace=False) for _ in range(points)])
    slopes = rng.normal(size=(2, points, 16))
    normals = rng.normal(size=(points, 3))
    weights = rng.uniform(0.5, 1.5, points)
    along_a, along_b = (ControlRows(indices, slope) for slope in slopes)
    penalty = AlignmentPenalty((along_a, along_b), np.ascontiguousarray(normals.T), weights, FLOOR)
    control = rng.normal(size=(3, 5, 10, 1))

    def shortfall(x):
        local = x.reshape(3, -1)[:, torch.as_tensor(indices)]  # (3, k, 16)
        a, b = ((torch.as_tensor(s) * local).sum(-1) for s in slopes)
        size = (torch.linalg.cross(a, b, dim=0) * torch.as_tensor(normals.T)).sum(0)
        return torch.as_tensor(weights).sqrt() * (FLOOR - size).clamp_min(0.0)

    return penalty, control, shortfall


def test_energy_gradient_and_gauss_newton_curvature_are_those_of_the_formula():
    penalty, control, shortfall = random_penalty()
    energy, gradient = penalty.energy_and_gradient(control)
    variable = torch.tensor(control, requires_grad=True)
    expected = shortfall(variable).square().sum()
    expected.backward()
    assert energy == pytest.approx(float(expected.detach()))
    assert gradient == pytest.approx(variable.grad.numpy())
    jacobian = torch.autograd.functional.jacobian(shortfall, variable.detach()).flatten(1).numpy()
    direction = np.random.default_rng(1).normal(size=control.shape)
    gauss_newton = 2.0 * jacobian.T @ (jacobian @ direction.ravel())
    found = penalty.curvature(control)(direction.astype(np.float32)).ravel()
    assert found == pytest.approx(gauss_newton, rel=1e-4, abs=1e-5 * np.abs(gauss_newton).max())


def box_fit(triangle_at):
    """A tetrahedron's worth of triangles on each face of the unit cube, and the identity's control points."""
    row = greville(NETS.knots[0][0], 3)
    control = np.stack(np.meshgrid(row, row, row, indexing="ij")).reshape(3, -1)
    corners, faces = [], []
    for side in range(6):
        axis = side // 2
        plane = [(axis + 1) % 3, (axis + 2) % 3][:: 1 if side % 2 else -1]
        piece = np.full((3, 3), float(side % 2))
        piece[:, plane] = triangle_at
        faces.append(len(corners) + np.arange(3))
        corners.extend(piece)
    points, faces = np.array(corners), np.array(faces)
    quadrics, weights = np.tile(np.eye(3), (18, 1, 1)), np.full(18, 1.0 / 18.0)
    return Correspondence(SlidingParameters(NETS, points, triangles=faces), points, quadrics, weights), control


@pytest.mark.parametrize("mirrored", [False, True])
def test_only_a_boundary_that_faces_the_other_way_is_penalised(mirrored):
    fit, control = box_fit(np.array([[0.2, 0.2], [0.7, 0.3], [0.4, 0.8]]))
    if mirrored:  # all faces now look into the solid, seen with the mesh's normals
        control[2] = 1.0 - control[2]
    energy, _ = alignment_penalty(fit, control, FLOOR).energy_and_gradient(control)
    # a unit face has (t_a x t_b) . n = 1, mirrored -1 on the faces across the mirror's plane; n turns with the faces
    expected = (FLOOR + 1.0) ** 2 if mirrored else 0.0
    assert energy == pytest.approx(expected * (2.0 / 3.0 if mirrored else 1.0))


def test_vertex_normals_weigh_triangles_by_area():
    vertices = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])  # normals +z (area 2) and +x (area 1)
    assert vertex_normals(vertices, faces)[0] == pytest.approx(np.array([1.0, 0.0, 2.0]) / np.sqrt(5.0))
