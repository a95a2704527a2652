"""Singular places of bodies, from their edges and the data: what is there is found, and nothing else."""

import numpy as np
import pytest

import iga_nn
from parameterize.spline.body import Body
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume
from solve.singular import singular_places


def block(low, high, points=4):
    def point(u, v, w):
        return tuple(a + (b - a) * t for a, b, t in zip(low, high, (u, v, w), strict=True))

    return BSplineVolume.from_function(point, points)


def found(body, problem):
    glued = body if isinstance(body, Body) else Body((body,))
    return singular_places(glued, problem.on(glued).on_patches(glued), [patch.knots for patch in glued])


@pytest.fixture(scope="module")
def corner():
    """An L of three blocks, its inner edge along z at x = y = 1."""
    return Body.from_patches([block((0, 0, 0), (1, 1, 1)), block((1, 0, 0), (2, 1, 1)), block((0, 1, 0), (1, 2, 1))])


@pytest.fixture(scope="module")
def rods():
    """Two blocks in a row, of two solids."""
    return Body.from_patches([block((0, 0, 0), (1, 1, 1)), block((1, 0, 0), (2, 1, 1))], solids=["a", "b"])


def test_the_inner_edge_of_an_l(corner):
    (edge,) = found(corner, iga_nn.Poisson(source="1"))
    assert (edge.kind, edge.text) == ("edge", "the re-entrant edge of 270° at (1, 1, 0.5)")
    assert edge.exponent == pytest.approx(2.0 / 3.0, abs=2e-3)
    np.testing.assert_allclose(edge.points[:, :2], 1.0, atol=1e-12)
    (other,) = found(corner, iga_nn.Elasticity(roller=["x < 1e-9", "z < 1e-9"], load={"ny < -0.9": (0, 1, 0)}))
    assert other.exponent == pytest.approx(0.5445, abs=2e-3)


def test_the_rim_of_a_whole_face():
    (rim,) = found(block((0, 0, 0), (2, 1, 1), 6), iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, 1)}))
    assert (rim.kind, rim.text) == ("rim", "the rim of fix 'u0'")
    assert rim.exponent == pytest.approx(0.711, abs=2e-3)
    np.testing.assert_allclose(rim.points[:, 0], 0.0, atol=1e-12)
    assert (np.isclose(rim.points[:, 1:] % 1.0, 0.0, atol=1e-9) | np.isclose(rim.points[:, 1:], 1.0)).any(axis=1).all()
    assert rim.radius == pytest.approx(2.0 * 2.0 / 3.0)  # three spans along x


def test_the_rim_of_a_region_inside_a_face():
    (rim,) = found(block((0, 0, 0), (2, 2, 1), 8), iga_nn.Poisson(value="nz > 0.9 and (x-1)**2+(y-1)**2 < 0.25"))
    np.testing.assert_allclose(np.hypot(rim.points[:, 0] - 1.0, rim.points[:, 1] - 1.0), 0.5, atol=2e-3)
    assert (rim.kind, rim.exponent) == ("rim", 0.5)
    angles = np.sort(np.arctan2(*(rim.points[:, :2] - 1.0).T))
    assert np.diff(angles).max() < 0.5


def test_planes_of_symmetry_and_whole_faces_are_not_singular():
    planes = ["x < 1e-9", "y < 1e-9", "z < 1e-9"]
    loaded = iga_nn.Elasticity(symmetry=planes, load={"nx > 0.9": (1, 0, 0)})
    assert not len(found(block((0, 0, 0), (2, 1, 1)), loaded))
    assert not len(found(block((0, 0, 0), (2, 1, 1)), iga_nn.Poisson(source="1", value="u0")))
    assert not len(found(benchmark_volume(3), iga_nn.Poisson(source="1")))


def test_overlapping_supports_have_no_rim_between_them():
    both = iga_nn.Elasticity(fix=["x < 1 and ny < -0.9", "x > 0.5 and ny < -0.9"], load={"ny > 0.9": (0, 1, 0)})
    (first, second) = found(block((0, 0, 0), (2, 1, 1), 6), both)
    every = np.concatenate([first.points, second.points])
    np.testing.assert_allclose(every[:, 1], 0.0, atol=1e-12)
    assert not np.any((np.abs(every[:, 0] - 1.0) < 0.9) & (np.abs(every[:, 2] - 0.5) < 0.4))


def test_the_edge_where_two_materials_meet_the_surface(rods):
    def held(young):
        return iga_nn.Elasticity(roller=["x < 1e-9", "y < 1e-9"], load={"x > 2-1e-9": (1, 0, 0)}, young=young)

    (edge,) = found(rods, held({"a": 1.0, "b": 10.0}))
    assert edge.kind == "materials"
    np.testing.assert_allclose(edge.points[:, 0], 1.0, atol=1e-12)
    assert not len(found(rods, held({"a": 1.0, "b": 1.0})))
    heated = iga_nn.Poisson(
        conditions=[iga_nn.Value("x < 1e-9", 0), iga_nn.Flux("x > 2-1e-9", 1)], kappa={"a": 1.0, "b": 10.0}
    )
    assert not len(found(rods, heated))


def test_a_smooth_surface_of_patches_has_no_edges():
    """A quarter of a thick pipe and its continuation: the edges between the two lie in the smooth surface."""

    def part(start):
        def point(u, v, w):
            angle = start + v * np.pi / 3
            return (1.0 + u) * np.cos(angle), (1.0 + u) * np.sin(angle), w

        return BSplineVolume.from_function(point, 7)

    pipe = Body.from_patches([part(0.0), part(np.pi / 3)])
    assert len(pipe.interfaces) == 1
    assert not len(found(pipe, iga_nn.Elasticity(roller=["z < 1e-9"], pressure={"x*x+y*y < 1.01": 1})))


def test_is_near():
    places = found(block((0, 0, 0), (8, 1, 1), (11, 4, 4)), iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, 1)}))
    assert places.is_near([[0.0, 0.0, 0.3], [1.9, 0.0, 0.0], [2.1, 0.0, 0.0]]).tolist() == [True, True, False]
    assert places.is_near([[1.9, 0.0, 0.0]], spans=1.0).tolist() == [False]
    assert not found(benchmark_volume(2), iga_nn.Poisson()).is_near([[0.0, 0.0, 0.0]]).any()


def test_coefficients_that_are_fields_or_differ_between_solids(rods):
    kappa = iga_nn.solve(rods, iga_nn.Poisson(exact="4+x")).field
    assert not len(iga_nn.solve(rods, iga_nn.Poisson(source="1", boundary="0", kappa=kappa)).singular)
    varied = iga_nn.Poisson(source="1", boundary="0", kappa={"a": "1+x*x", "b": lambda x, y, z: 2.0 + 0.0 * x})
    assert not len(found(rods, varied))
