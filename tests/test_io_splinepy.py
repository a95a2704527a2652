"""Bodies as lists of splines and multipatches of splinepy."""

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from glued import POINTS, demand_same

import iga_nn
from parameterize.spline.volume import FACE_NAMES

splinepy = pytest.importorskip("splinepy")

WAYS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]
CORNER = row_of([(0, 0, 0), (1, 0, 0), (1, 1, 0)], WAYS)
BODIES = [CORNER, ring(3), ring(1)]


@pytest.mark.parametrize("body", BODIES, ids=["corner", "three", "ring"])
def test_a_body_is_a_multipatch_and_back(body):
    patches = body.to_splinepy()
    demand_same(iga_nn.Body.from_splinepy(patches), body)
    demand_same(iga_nn.Body.from_splinepy(list(patches.patches)), body)
    for spline, patch in zip(patches.patches, body, strict=True):
        assert np.abs(spline.evaluate(POINTS) - patch(POINTS)).max() < 1e-14


def test_splinepy_finds_the_same_interfaces():
    """Its number of a face is six times that of the patch, and the face's: u0, u1, v0, v1, w0, w1."""
    patches = CORNER.to_splinepy()
    given = np.array(patches.interfaces)
    patches.determine_interfaces()
    assert np.array_equal(given >= 0, np.array(patches.interfaces) >= 0)
    assert np.array_equal(given[given >= 0], np.array(patches.interfaces)[given >= 0])
    assert (given >= 0).sum() == 2 * len(CORNER.interfaces) and given.shape == (3, len(FACE_NAMES))


@pytest.mark.parametrize("body", BODIES, ids=["corner", "three", "ring"])
def test_a_list_in_json_is_read_again(body, in_folder):
    body.save("body.npz")
    demand_same(iga_nn.load_volume(iga_nn.export("body.npz", "json")), body)
    assert len(splinepy.io.json.load("body.json")) == len(body)


def test_rational_patches_are_nurbs():
    patches = exact_ring().to_splinepy()
    assert {spline.name for spline in patches.patches} == {"NURBS"}
    assert len(iga_nn.Body.from_splinepy(patches).interfaces) == 4


@pytest.mark.parametrize("other", [3, [3], [np.zeros(3)]])
def test_other_objects_are_refused(other):
    with pytest.raises(TypeError, match="must be"):
        iga_nn.Body.from_splinepy(other)
