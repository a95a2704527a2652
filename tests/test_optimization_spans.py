import numpy as np
import pytest
from block_bodies import BODIES, rod, sampled, uniform_nets

from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.spans import acting_on, edge_spans, in_blocks, numbers, with_neighbours


def test_edge_spans():
    spans = edge_spans(uniform_nets((4, 5, 6)))
    assert len(spans) == len(np.unique(spans, axis=0)) == 4 * (2 + 3 + 4) + 8
    assert [0, 0, 2, 0] in spans.tolist() and [0, 3, 4, 2] in spans.tolist()
    assert [0, 0, 2, 2] not in spans.tolist() and [0, 1, 1, 1] not in spans.tolist()
    assert len(edge_spans(uniform_nets((2, 2, 2)))) == 8 and len(edge_spans(uniform_nets((1, 1, 1)))) == 1


def test_neighbours_and_the_control_points_that_act():
    nets = uniform_nets((4, 5, 6))
    marked = with_neighbours(np.array([[0, 0, 2, 3]]), nets).reshape(4, 5, 6)
    assert np.argwhere(marked).min(axis=0).tolist() == [0, 1, 2] and np.argwhere(marked).max(axis=0).tolist() == [
        1,
        3,
        4,
    ]
    assert marked.sum() == 2 * 3 * 3
    one = np.zeros((4, 5, 6), dtype=bool)
    one[1, 2, 3] = True
    acting = np.argwhere(acting_on(one.ravel(), nets).reshape(7, 8, 9))  # spans 1, 2 and 3: four functions a direction
    assert acting.min(axis=0).tolist() == [1, 2, 3] and acting.max(axis=0).tolist() == [4, 5, 6] and len(acting) == 4**3


TURNS = (0, 5, 7, 11)
ALL = [(name, turn) for name in BODIES for turn in TURNS]


def middles(spline):
    """The middle of each span of all blocks in space, (m, 3), and the corners of the spans, (m, 8, 3)."""
    middle, corners = [], []
    for block, counts in enumerate(spline.nets.spans):
        index = np.indices(counts).reshape(3, -1).T
        patch, ends = spline.patch(block), np.indices((2, 2, 2)).reshape(3, -1).T
        middle.append(patch((index + 0.5) / counts))
        corners.append(patch(((index[:, None] + ends) / counts).reshape(-1, 3)).reshape(-1, 8, 3))
    return np.concatenate(middle), np.concatenate(corners)


def test_spans_of_blocks_are_numbered_one_after_the_other():
    nets = uniform_nets((1, 2, 3), (2, 3, 2))
    spans = in_blocks([np.indices(counts).reshape(3, -1).T for counts in nets.spans])
    assert spans.shape == (18, 4) and spans[6].tolist() == [1, 0, 0, 0]
    assert numbers(spans, nets).tolist() == list(range(18))
    assert in_blocks([np.zeros((0, 3), dtype=np.int64)] * 2).shape == (0, 4)


def test_edges_are_those_of_every_block():
    spans = edge_spans(uniform_nets((1, 2, 3), (3, 3, 3)))
    assert (spans[:, 0] == 0).sum() == 6 and (spans[:, 0] == 1).sum() == 20
    assert [1, 1, 1, 0] not in spans.tolist() and [1, 1, 0, 0] in spans.tolist()


@pytest.mark.parametrize(("name", "turn"), ALL)
def test_neighbours_are_the_spans_that_share_a_corner_in_space(name, turn):
    spline = BODIES[name](turn)
    _, corners = middles(spline)
    for chosen in ([0], [13], [len(corners) - 1, 5]):
        nets, own = spline.nets, corners[chosen].reshape(-1, 3)
        spans = in_blocks([np.indices(counts).reshape(3, -1).T for counts in nets.spans])[chosen]
        apart = np.linalg.norm(corners[:, :, None] - own, axis=-1).min(axis=(1, 2))
        assert np.array_equal(with_neighbours(spans, nets), apart < 1e-9)


@pytest.mark.parametrize(("name", "turn"), ALL)
def test_control_points_that_act_are_those_that_move_the_map_there(name, turn):
    """A control point moves together with those that interfaces make one with it."""
    spline = BODIES[name](turn)
    nets = spline.nets
    chosen = np.zeros(nets.first_spans[-1], dtype=bool)
    chosen[[0, 8, -1]] = True
    acting = acting_on(chosen, nets)
    spans = np.flatnonzero(chosen)
    blocks = np.searchsorted(nets.first_spans, spans, "right") - 1
    expected = np.zeros(nets.starts[-1])
    for number, block in zip(spans, blocks, strict=True):
        place = np.unravel_index(number - nets.first_spans[block], nets.spans[block])
        window = np.zeros(nets.shapes[block])
        window[tuple(slice(i, i + nets.degree + 1) for i in place)] = 1.0
        expected[nets.starts[block] : nets.starts[block + 1]] += window.ravel()
    assert np.array_equal(acting, nets.merged(expected) > 0.0)
    assert np.array_equal(nets.merged_mask(acting), acting) and not acting.all()


def test_points_near_spans_are_found_across_an_interface():
    spline = rod(7, lengths=(1.0, 2.0))
    surface = sampled(spline, 13)  # four steps a span
    places = SlidingParameters(spline.nets, surface.parameters, surface.sample_faces)
    spans = places.spans()
    assert np.array_equal(spans[:, 0], surface.sample_faces // 6)
    assert np.array_equal(spans[:, 1:], np.minimum((3.0 * surface.parameters + 1e-9).astype(np.int64), 2))
    near = places.near_spans(np.array([[0, 2, 1, 1]]))  # at the interface, in the middle of a section of 3 x 3 spans
    x = places.values(spline.control)[:, 0]
    assert near[(x > 0.4) & (x < 1.6)].all() and not near[(x < 0.3) | (x > 1.7)].any()
    assert near[spans[:, 0] == 1].any()
