"""Tables of binary files whose headers promise what cannot be."""

import pytest

from parameterize.surface.errors import MeshError
from parameterize.surface.readers.words import Binary


@pytest.mark.parametrize("columns", [2**31 - 1, 2**31, 2**40])
@pytest.mark.parametrize("rows", [1, 1000])
def test_more_columns_than_a_row_can_have(columns, rows):
    with pytest.raises(MeshError, match=r"promises \d+ more bytes, where 16 follow"):
        Binary(bytes(16), "<", "the table").table(rows, [("i4", 1), ("i4", columns)])


def test_no_rows_of_any_width():
    first, second = Binary(b"", ">", "the table").table(0, [("i4", 2**40), ("f8", 3)])
    assert first.shape == (0, 2**40) and second.shape == (0, 3)


def test_rows_of_several_parts_in_both_orders():
    for order, content in (("<", b"\x01\x00\x02\x00"), (">", b"\x00\x01\x00\x02")):
        (numbers,) = Binary(content, order, "the table").table(2, [("i2", 1)])
        assert numbers.tolist() == [[1], [2]]
