"""Which points of patches are one, and on which sides of an interface patches lie, against the points themselves."""

import numpy as np
import pytest
from patches import SYMMETRIES, around_a_line, frame, patch, plate_with_hole, ring, turned

from parameterize.certificate.gluing import on_one_side
from parameterize.certificate.patch_proofs import boundary_pieces, halved
from parameterize.spline.body import Body
from parameterize.spline.interface import axis_side
from parameterize.spline.volume import BSplineVolume


def mixed(body, seed):
    """The same body, the parameters of each patch exchanged and reversed at random."""
    ways = np.random.default_rng(seed).integers(len(SYMMETRIES), size=len(body))
    return Body.from_patches([turned(one, SYMMETRIES[way]) for one, way in zip(body, ways, strict=True)])


BODIES = {
    "plate": plate_with_hole(5),
    "frame": frame(),
    "ring": Body.from_patches([patch(ring(0, 1), (6, 4, 4))]),
    "ring of four": Body.from_patches([patch(ring(k / 4, (k + 1) / 4)) for k in range(4)]),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", BODIES)
def test_points_have_one_name_where_they_are_one(name, seed):
    """Corners of pieces of a one-to-one body are the same points exactly where their names are the same."""
    pieces = boundary_pieces(mixed(BODIES[name], seed))
    for _ in range(3):
        points = pieces.nets[:, :: len(pieces.nets[0]) - 1, :: len(pieces.nets[0]) - 1].reshape(-1, 3)
        names = pieces.names[:, :4].reshape(-1, 3)
        _, by_point = np.unique(points.round(9) + 0.0, axis=0, return_inverse=True)
        _, by_name = np.unique(names, axis=0, return_inverse=True)
        both = np.unique(np.stack([by_point.ravel(), by_name.ravel()]), axis=1)
        assert both.shape[1] == by_point.max() + 1 == by_name.max() + 1
        every = np.arange(len(pieces.nets))
        pieces, _ = halved(pieces, np.stack([every, every], axis=1))


def test_the_middles_of_edges_have_the_names_of_the_corners_one_cut_later():
    pieces = boundary_pieces(mixed(BODIES["plate"], 7))
    every = np.arange(len(pieces.nets))
    finer, _ = halved(pieces, np.stack([every, every], axis=1))
    middles = {(number, 2 * a, 2 * b) for number, a, b in pieces.names[:, 4:].reshape(-1, 3).tolist()}
    assert middles <= {tuple(row) for row in finer.names[:, :4].reshape(-1, 3).tolist()}


def outward(volume, face):
    """The derivative out of a patch, in the middle of a face."""
    axis, side = axis_side(face)
    place = np.full(3, 0.5)
    place[axis] = side
    return (1.0 if side else -1.0) * volume.jacobian([place])[0][:, axis]


@pytest.mark.parametrize("second", [lambda u, v, w: (1.0 + u, v, w), lambda u, v, w: (1.0 - 0.5 * u, v, w)])
def test_sides_of_an_interface_are_those_of_the_derivatives_across(second):
    first = patch(lambda u, v, w: (u, v, w))
    rng = np.random.default_rng(0)
    for _ in range(60):
        ways = [SYMMETRIES[k] for k in rng.integers(len(SYMMETRIES), size=2)]
        body = Body.from_patches([turned(one, way) for one, way in zip((first, patch(second)), ways, strict=True)])
        (interface,) = body.interfaces
        signs = np.array([int(np.sign(np.linalg.det(one.jacobian([[0.5, 0.5, 0.5]])[0]))) for one in body])
        a, b = (outward(body.patches[k], face) for k, face in (interface.first, interface.second))
        assert on_one_side(body.interface_rows, signs).tolist() == [a @ b > 0.0]


def test_faces_of_one_patch_that_turn_around_a_line():
    """Directions of the two faces of these interfaces run alike although their axes have other names."""
    assert not on_one_side(around_a_line(4).interface_rows, np.ones(4, dtype=int)).any()
    mirrored = [
        BSplineVolume(one.degrees, one.knots, one.control_points * [-1.0, 1.0, 1.0]) for one in around_a_line(4)
    ]
    body = Body(tuple(mirrored), around_a_line(4).interfaces)
    assert not on_one_side(body.interface_rows, -np.ones(4, dtype=int)).any()
