"""Tests the elastic law of one material: orthotropic stiffness, its axes, and its thermal stress."""

from itertools import product

import numpy as np
import pytest

import iga_nn
from solve import benchmark_volume
from solve.field import Points
from solve.forms.axes import Tangents
from solve.forms.hooke import Hooke
from solve.forms.library import MATERIALS
from solve.forms.stiffness import is_the_same_across, nearest_isotropic

CARBON = {
    "young": (126.0, 11.0, 11.0),
    "poisson_ratio": (0.28, 0.28, 0.4),
    "shear_modulus": (6.6, 6.6, 11.0 / 2.8),
}
SHEAR = 1.0 / 2.6
ROUND = {"young": (1.0,) * 3, "poisson_ratio": (0.3,) * 3, "shear_modulus": (SHEAR,) * 3}


def strain(*entries):
    xx, yy, zz, yz, xz, xy = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def test_equal_constants_are_the_isotropic_law():
    grad = np.random.default_rng(0).standard_normal((3, 3, 5))
    assert np.allclose(Hooke(**ROUND).stress(grad), Hooke(1.0, 0.3).stress(grad), rtol=0, atol=1e-12)
    assert np.allclose(nearest_isotropic(Hooke(**ROUND).stiffness), Hooke(1.0, 0.3).lame)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1])
def test_a_pull_off_the_axis_strains_as_the_compliance_says(angle):
    """Compare with 1/E_x = c^4/E1 + (1/G12 - 2 nu12/E1) s^2 c^2 + s^4/E2 (Jones 1999, equation 2.97)."""
    c, s = np.cos(angle), np.sin(angle)
    axes = ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))
    law = Hooke(**CARBON, axes=axes)
    matrix = np.array([law.stress(unit)[np.triu_indices(3)] for unit in np.eye(9).reshape(9, 3, 3)]).T
    found = np.linalg.lstsq(matrix, np.array([1.0, 0, 0, 0, 0, 0]), rcond=None)[0].reshape(3, 3)
    expected = c**4 / 126.0 + (1 / 6.6 - 2 * 0.28 / 126.0) * s**2 * c**2 + s**4 / 11.0
    assert abs((found + found.T)[0, 0] / 2 - expected) < 1e-12


def test_constants_that_no_material_has_are_refused():
    with pytest.raises(ValueError, match="not positive definite; it needs nu12 between -3.384 and 3.384"):
        Hooke(CARBON["young"], (4.0, 0.28, 0.4), CARBON["shear_modulus"])
    with pytest.raises(ValueError, match="E1, E2, E3"):
        Hooke(CARBON["young"], 0.3)
    with pytest.raises(ValueError, match="second_axis is needed"):
        iga_nn.Elasticity(material="spruce", first_axis=(1, 1, 0))


def test_every_orthotropic_material_of_the_library_is_stable():
    for one in MATERIALS:
        law = Hooke(one.young, one.poisson_ratio, one.shear_modulus, one.expansion)
        assert law.lame.shear > 0.0
        if one.name in ("CFRP", "GFRP"):
            assert is_the_same_across(law.stiffness)


def test_a_law_without_volume_keeps_the_thermal_stress():
    law = Hooke(1.0, 0.3, expansion=1e-3)
    assert np.array_equal(law.without_volume().hold, law.hold)
    assert np.allclose(law.hold, np.eye(3) * 1e-3 / 0.4)


def test_axes_along_parameters_are_the_lines_of_the_map():
    volume, rows = benchmark_volume(2), (np.array([0.3]), np.array([0.1, 0.7]), np.array([0.2, 0.5, 0.9]))
    u, v, w = rows
    tangents, grid = Tangents.of(volume, "v"), np.moveaxis(volume.grid(*rows), -1, 0)
    plane = tangents.at(Points.of(np.ascontiguousarray(grid[:, 0].swapaxes(1, 2)), rows, (2, 1)))
    for (i, one), (j, other) in product(enumerate(v), enumerate(w)):
        place = np.array([[u[0], one, other]])
        line = volume.jacobian(place)[0, :, 1]
        assert np.allclose(plane[:, j, i], line)
        assert np.allclose(tangents.at(Points.at(volume(place).T, place))[:, 0], line)


def test_a_body_with_axes_along_the_map_is_that_with_the_same_vectors():
    box = iga_nn.BSplineVolume.uniform(
        [[[[2 * i + j, j, k] for k in (0, 1)] for j in (0, 1)] for i in (0, 1)], degree=1
    )
    law = {"fix": "u0", "load": {"u1": (0, 1, 1)}, **CARBON}
    found = [
        iga_nn.solve(box, iga_nn.Elasticity(first_axis=axis, **law), degree=2).field.coefficients
        for axis in ("v", (1, 1, 0), ("1+0*x", "1", "0"))
    ]
    assert np.allclose(found[0], found[1], rtol=1e-6) and np.allclose(found[2], found[1], rtol=1e-6)
