import numpy as np
import pytest

import iga_nn
from solve.discretization.grading import MOST_HALVINGS, Grading
from solve.refinement.marking import BOTH, LEFT, SheetSpans, marked, smooth_part, unknowns_of


def graded(spans=(2, 2, 2)):
    return Grading.of(iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), tuple(n + 1 for n in spans), 1))


def of(grading, values, degree=2, before=None):
    return SheetSpans.of(grading, np.concatenate([np.array(row, dtype=float) for row in values]), degree, before)


def counts_of(grading, degree=2):
    return np.array([grading.spans]) + degree


def chosen(grading, spans, growth=1.1, target=0.0):
    return marked(grading, spans, counts_of(grading), 2, growth, target)


def test_the_span_that_misses_most_is_halved_first():
    grading = graded()
    found = chosen(grading, of(grading, [[9, 1], [0, 0], [0, 0]]))
    assert found.rows[0].tolist() == [0, 0.5, 1, 2] and found.spans[1:] == (2, 2)


def test_cheap_spans_go_first():
    """A new span of the first direction adds (20 + 2 - 1) x 3 unknowns, one of the second 3 x 3."""
    grading = graded((2, 20, 2))
    found = chosen(grading, of(grading, [[1, 1], [0.4] + [0] * 19, [0, 0]]), growth=1.01)
    assert found.spans == (2, 21, 2)


def test_what_halving_left_is_expected_again():
    grading = graded((1, 1, 1))
    first = of(grading, [[1.0], [0], [0]])
    halves = grading.refined({0: [1]})
    spans = of(halves, [[0.5, 0.01], [0], [0]], before=first)
    assert spans.side[:2].tolist() == [LEFT, BOTH] and spans.kept[0] == pytest.approx(0.5)
    found = chosen(halves, spans, growth=2.0)
    assert found.rows[0].min() == 0 and np.diff(found.rows[0])[0] < 0.2  # many times towards the edge in one step
    smooth = of(halves, [[smooth_part(2)] * 2, [0], [0]], before=first)
    assert smooth.side[:2].tolist() == [BOTH, BOTH]


def test_the_space_grows_by_the_factor_and_not_much_more():
    grading = graded((4, 4, 4))
    values = 1.0 + np.random.default_rng(0).random((3, 4))
    found = chosen(grading, of(grading, values), 2.0)
    grown = unknowns_of(counts_of(found)) / unknowns_of(counts_of(grading))
    assert 2.0 <= grown < 3.0


def test_the_target_ends_the_marks():
    grading = graded((4, 1, 1))
    found = chosen(grading, of(grading, [[1, 1, 1, 1], [0], [0]]), growth=100.0, target=0.5)
    assert found.spans == (8, 1, 1)


def test_spans_are_not_halved_without_end():
    grading = graded((1, 1, 1)).refined({0: [1]})
    for _ in range(MOST_HALVINGS - 1):
        grading = grading.refined({0: [1] + [0] * (grading.spans[0] - 1)})
    found = chosen(grading, of(grading, [[1] + [0] * (grading.spans[0] - 1), [0], [0]]))
    assert found.spans == grading.spans
