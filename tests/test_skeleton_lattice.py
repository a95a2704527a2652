"""The lattice inside a body has its topology."""

from __future__ import annotations

import numpy as np
import pytest
from thick_bodies import capsule, implicit, ring

from parameterize.layouts.skeleton.lattice import lattices

GAP = 0.03


def first(body):
    vertices, faces, genus = body
    return next(lattice for lattice in lattices(vertices, faces, genus) if lattice.has_topology(genus))


def test_volume_and_betti_number_are_those_of_the_torus():
    lattice = first(implicit(lambda x: ring(x, 0.0, 1.0, 0.3), (1.4, 1.4, 0.4)))
    assert lattice.betti == 1 and lattice.cell == 0.04
    assert lattice.inside.sum() * lattice.cell**3 == pytest.approx(1.0, rel=0.02)


def test_arms_with_a_gap_of_less_than_a_cell_between_them_stay_apart():
    """A hairpin of genus 0, whose arms would close a loop where lattice points are joined through the gap."""
    arms = [((-1.0, side * (0.2 + GAP), 0), (1.0, side * (0.2 + GAP / 2), 0)) for side in (-1, 1)]
    bend = ((-1.0, -0.2, 0), (-1.0, 0.2, 0))
    body = implicit(
        lambda x: np.minimum.reduce([capsule(x, *ends, 0.2) for ends in (*arms, bend)]), (1.3, 0.6, 0.3), 160
    )
    assert body[2] == 0
    lattice = first(body)
    assert lattice.betti == 0 and lattice.cell > GAP and lattice.lost == 0.0
