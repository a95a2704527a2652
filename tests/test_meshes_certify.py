"""Meshes with known answers: none is wrong."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from known_meshes import KNOWN, grid, hexahedron

from parameterize.meshes.certify import certify_mesh
from parameterize.meshes.evaluation import exact_determinant, point_at
from parameterize.meshes.mesh import VolumeMesh
from parameterize.meshes.search import FOLDED, INVERTED

GAUSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)


@pytest.mark.parametrize("name", KNOWN)
def test_known_meshes_have_their_answers(name):
    known = KNOWN[name]
    mesh = known.mesh()
    found = certify_mesh(mesh)
    assert (found.verdict, found.overlap.overlap) == (known.verdict, known.overlap), found.overlap
    assert (found.orientation == "left-handed") == known.left_handed
    assert found.overlap.touching == known.touching
    assert known.worst is None or found.worst.number == known.worst
    assert known.reason in found.overlap.reason
    assert found.is_proved == (known.verdict == "certified" and known.overlap is False)
    assert str(found).startswith(known.verdict)
    if known.hidden:
        corners = np.array(list(product((0.0, 1.0), repeat=3)))
        rows = [*corners, *(np.array(row) for row in product(GAUSS, repeat=3))]
        nodes = mesh.points[mesh.blocks[0].nodes[0]]
        assert min(exact_determinant(mesh.blocks[0].kind, nodes, row) for row in rows) > 0


@pytest.mark.parametrize("name", [name for name, known in KNOWN.items() if known.verdict in ("folded", "flat")])
def test_witnesses_refute_without_rounding(name):
    mesh = KNOWN[name].mesh()
    found = certify_mesh(mesh)
    for block, own in zip(mesh.blocks, found.blocks, strict=True):
        for row in np.flatnonzero(np.isin(own.verdicts, (FOLDED, INVERTED))):
            assert own.sign * exact_determinant(block.kind, mesh.points[block.nodes[row]], own.witnesses[row]) < 0
    worst = found.worst
    block = next(block for block in mesh.blocks if worst.number in block.numbers)
    nodes = mesh.points[block.nodes[list(block.numbers).index(worst.number)]]
    assert np.allclose(point_at(block.kind, nodes, np.array(worst.parameters)), worst.point)


def test_volumes_and_facts():
    found = certify_mesh(grid(hexahedron(2), (2, 1, 1), lambda x: x * [2.0, 3.0, 0.5]))
    facts = found.as_dict()
    assert facts["volume"] == pytest.approx(3.0) and facts["elements"] == {"hexahedron27": 2}
    assert facts["scaled_jacobian"] == pytest.approx(1.0) and facts["verdicts"]["positive"] == 2


def test_bad_meshes_are_refused():
    with pytest.raises(ValueError, match="not finite"):
        VolumeMesh.of(np.full((8, 3), np.nan), {"hexahedron": [range(8)]})
    with pytest.raises(ValueError, match="does not hold"):
        VolumeMesh.of(np.zeros((4, 3)), {"tetra": [[0, 1, 2, 4]]})
    with pytest.raises(ValueError, match="no hexahedra"):
        VolumeMesh(np.zeros((1, 3)), (), {"wedge": 2})
    with pytest.raises(ValueError, match="rows of 4"):
        VolumeMesh.of(np.zeros((4, 3)), {"tetra": [[0, 1, 2]]})
