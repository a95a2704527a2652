import numpy as np
from block_bodies import uniform_nets

from parameterize.optimization.spans import acting_on, edge_spans, with_neighbours


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
