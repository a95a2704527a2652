import threading

import numpy as np
import pytest

from parameterize.threads import default_threads, in_parallel


@pytest.mark.parametrize("threads", [1, 3])
def test_every_piece_is_done_and_errors_come_through(threads):
    done = np.zeros(10)

    def mark(i):
        if i == 7:
            raise ValueError("seven")
        done[i] += 1

    in_parallel(mark, range(5), threads)
    assert done.tolist() == [1.0] * 5 + [0.0] * 5
    with pytest.raises(ValueError, match="seven"):
        in_parallel(mark, range(5, 10), threads)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_pieces_may_be_made_of_pieces_and_results_keep_their_order(threads):
    def rows(i):
        return in_parallel(lambda j: (i, j), range(4), threads)

    assert in_parallel(rows, range(5), threads) == [[(i, j) for j in range(4)] for i in range(5)]


def test_the_calling_thread_works_too():
    barrier = threading.Barrier(2, timeout=10.0)  # two pieces that wait for each other: one thread would not come back
    names = in_parallel(lambda _: barrier.wait() >= 0 and threading.current_thread().name, range(2), 2)
    assert threading.current_thread().name in names and len(set(names)) == 2


def test_number_of_threads_follows_the_environment(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "3")
    assert default_threads() == 3
    monkeypatch.delenv("NUMBA_NUM_THREADS")
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert default_threads() == 2
