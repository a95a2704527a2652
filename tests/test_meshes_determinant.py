"""The bounds of det J hold its exact values, on whole elements and on their parts."""

from __future__ import annotations

import numpy as np
import pytest

from parameterize.meshes.determinant import ElementForm, reference_corners
from parameterize.meshes.evaluation import exact_determinant
from parameterize.meshes.kinds import SERENDIPITY, hexahedron, tetra

KINDS = [hexahedron(1), SERENDIPITY, hexahedron(2), hexahedron(2, 1, 3), tetra(1), tetra(2), tetra(3)]


def _nodes(kind, count, amplitude, seed=0):
    rng = np.random.default_rng(seed)
    straight = kind.lattice / np.array(kind.degrees)
    return straight + amplitude * rng.normal(size=(count, *straight.shape))


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_values_at_corners_of_parts_are_exact_within_the_bound(kind):
    nodes = _nodes(kind, 2, 0.05) + 1e3
    form = ElementForm(kind)
    found = form.coefficients(nodes)
    values, places = found.values[1:], reference_corners(kind)[None]
    for depth in range(3):
        if depth:
            values, places = form.parts(values)[:12], form.part_places(places)[:12]
        error = found.errors[1] + form.halving_error(found.permanents[1], depth)
        for row, corners in zip(form.flat(values)[::5], places[::5], strict=True):
            for coefficient, place in zip(row[form.corners], corners, strict=True):
                exact = float(exact_determinant(kind, nodes[1], place))
                assert abs(np.ldexp(coefficient, found.exponents[1]) - exact) <= np.ldexp(error, found.exponents[1])


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_affine_elements_have_a_constant_determinant(kind):
    matrix = np.array([[2.0, 0.25, 0.0], [0.0, 1.0, 0.5], [0.125, 0.0, 4.0]])
    nodes = (kind.lattice / np.array(kind.degrees)) @ matrix.T
    found = ElementForm(kind).coefficients(nodes[None])
    assert np.allclose(np.ldexp(found.values, found.exponents[0]), np.linalg.det(matrix), rtol=1e-12)
    assert found.errors[0] < 1e-10
