"""Writes Bezier extraction files (.bext), as LS-DYNA and Coreform's programs take them: *IGA_INCLUDE_BEZIER.

Coreform Cubit, "The Bezier extraction file format", ASCII, version 2.0. Control points are shared at interfaces. On an
element every spline function is a sum of Bernstein polynomials, u fastest, with the components of a coefficient vector;
equal vectors are written once. Left-handed patches have w reversed. A rational body is refused.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bernstein import extraction
from parameterize.spline.body import BodyLike, all_control_points, as_body
from parameterize.spline.volume import BSplineVolume

from ..errors import InputError
from .mfem_writer import right_handed

HEAD = "B E X T 2.0"
DENSE = 1  # the type of elements whose vectors are those of all three directions together
WHOLES, REALS = 10, 5  # numbers in a line


def write_bezier_extraction(path: Path, given: BodyLike) -> None:
    """Write a body. Raises InputError where it is rational, OSError for the file."""
    body = right_handed(as_body(given))
    if any(patch.weights is not None for patch in body):
        raise InputError("a rational body is not written as Bezier extraction: export it --to gismo or vtk")
    labels, count = body.numbering
    points = np.empty((count, 3))
    points[np.concatenate([row.ravel() for row in labels])] = all_control_points(body.patches)
    vectors: dict[bytes, int] = {}  # the numbers of coefficient vectors, from 1
    kept: dict[int, list[Array]] = defaultdict(list)  # by their length
    blocks: dict[tuple[int, int, int], list[tuple[IntArray, IntArray]]] = defaultdict(list)
    lengths = sorted({int(np.prod(np.add(patch.degrees, 1))) for patch in body})
    for patch in body:
        for vector in (row for length in lengths if length == _length(patch) for row in _vectors(patch)):
            if vector.tobytes() not in vectors:
                vectors[vector.tobytes()] = len(kept[len(vector)])
                kept[len(vector)].append(vector)
    starts = dict(zip(lengths, np.cumsum([0, *(len(kept[n]) for n in lengths)]).tolist(), strict=False))
    for patch, label in zip(body, labels, strict=True):
        first = starts[_length(patch)]
        for nodes, rows in _elements(patch, label):
            numbers = np.array([1 + first + vectors[row.tobytes()] for row in rows])
            blocks[patch.degrees].append((nodes + 1, numbers))
    path.write_text("\n".join(_lines(points, blocks, [kept[n] for n in lengths])) + "\n", encoding="ascii")


def _length(patch: BSplineVolume) -> int:
    """Return the number of functions on an element."""
    return int(np.prod(np.add(patch.degrees, 1)))


def _vectors(patch: BSplineVolume) -> Iterator[Array]:
    """Yield the coefficient vectors of all elements of a patch."""
    u, v, w = (extraction(row, degree)[1] for row, degree in zip(patch.knots, patch.degrees, strict=True))
    for one in np.unique(u, axis=0):
        for other in np.unique(v, axis=0):
            for third in np.unique(w, axis=0):
                yield from _product(one, other, third)


def _product(u: Array, v: Array, w: Array) -> Array:
    """Return the vectors (functions, Bernstein polynomials) of an element, both with u fastest.

    u, v, w: (p + 1, p + 1) each, Bernstein coefficients of the functions of a direction, which are its columns.
    """
    whole = np.einsum("ai,bj,ck->kjicba", u, v, w)
    size = len(u) * len(v) * len(w)
    return np.ascontiguousarray(whole.reshape(size, size)) + 0.0


def _elements(patch: BSplineVolume, label: IntArray) -> Iterator[tuple[IntArray, Array]]:
    """Yield the control points of each element, from 0 in the body, and their coefficient vectors."""
    (a, u), (b, v), (c, w) = (extraction(row, degree) for row, degree in zip(patch.knots, patch.degrees, strict=True))
    p, q, r = patch.degrees
    for k, third in enumerate(c.tolist()):
        for j, second in enumerate(b.tolist()):
            for i, first in enumerate(a.tolist()):
                own = label[first : first + p + 1, second : second + q + 1, third : third + r + 1]
                yield own.ravel(order="F"), _product(u[i], v[j], w[k])


def _lines(
    points: Array,
    blocks: dict[tuple[int, int, int], list[tuple[IntArray, IntArray]]],
    vectors: Sequence[Sequence[Array]],
) -> Iterator[str]:
    count = sum(map(len, blocks.values()))
    yield HEAD
    yield f"1 {len(points)} {count} {sum(map(len, vectors))} 0"
    yield from (f"{x!r} {y!r} {z!r} 1.0" for x, y, z in points.tolist())
    yield str(len(blocks))
    for (p, q, r), own in blocks.items():
        functions = (p + 1) * (q + 1) * (r + 1)
        yield f"{DENSE} {len(own)} {functions} {functions} {p} {q} {r}"
    for own in blocks.values():
        for nodes, numbers in own:
            yield from _rows(nodes.tolist(), WHOLES)
            yield from _rows(numbers.tolist(), WHOLES)
    yield f"{len(vectors)} 0"
    yield from (f"{len(some)} {len(some[0])}" for some in vectors)
    for some in vectors:
        for vector in some:
            yield from _rows(map(repr, vector.tolist()), REALS)


def _rows(entries: Iterable[object], most: int) -> Iterator[str]:
    words = list(map(str, entries))
    yield from (" ".join(words[begin : begin + most]) for begin in range(0, len(words), most))
