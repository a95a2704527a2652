"""A fixed slice of the mutation fuzzer, and what Hypothesis makes of arrays, corners and formulas."""

import json
import math
from pathlib import Path

import fuzzing
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from iga_nn.errors import InputError
from iga_nn.workflow.mapping import read_corners
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.files import save_arrays
from parameterize.spline.volume import BSplineVolume
from solve.field import SplineField
from solve.forms.parser import Expression, ExpressionError

SLICE = 20  # files a reader
QUICK = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.mark.parametrize("reader", fuzzing.readers(), ids=lambda reader: reader.name)
def test_spoiled_files_are_accepted_or_refused_in_one_line(reader, tmp_path):
    fuzzing.check_seeds(reader)
    for number in range(round(reader.share * SLICE)):
        suffix, content = fuzzing.file_of(reader, 1, number, SLICE)
        outcome, said = fuzzing.judge(reader, tmp_path / f"file{suffix}", content)
        assert outcome in ("accepted", "refused"), (number, said)


def test_the_fuzzer_finds_what_is_wrong(tmp_path):
    """A reader that lets an error of its own out, one that names no file, one that talks, one that only exits."""

    def raising(error):
        def read(path):
            raise error

        return read

    def judged(read):
        reader = fuzzing.Reader("any", ".txt", read, ([b"x"],))
        return fuzzing.judge(reader, tmp_path / "file.txt", b"x")[0]

    assert judged(lambda path: None) == "accepted"
    assert judged(raising(InputError("file.txt: no good"))) == "refused"
    assert judged(raising(InputError("no good"))) == "crashed"
    assert judged(raising(ZeroDivisionError())) == judged(raising(SystemExit(1))) == "crashed"
    assert judged(lambda path: fuzzing.os.write(2, b"warning: no good")) == "crashed"


def test_a_process_that_dies_is_counted_and_its_file_kept(tmp_path):
    reader = fuzzing.Reader("dying", ".txt", lambda path: fuzzing.os._exit(3), ([b"x"],))
    tally = fuzzing.survey(reader, 0, 3, tmp_path)
    assert tally.outcomes == {"crashed": 3}
    assert len(list(tmp_path.glob("dying-*.txt"))) == 3


def test_knot_spans_too_narrow_for_derivatives_are_refused(tmp_path):
    """Found by the fuzzer: the certificate of such a volume ended in a traceback."""
    volume = fuzzing.bent(4, 2)
    knots = volume.knots[0].copy()
    knots[3] = 1e-310
    BSplineVolume(volume.degrees, (knots, *volume.knots[1:]), volume.control_points).save(tmp_path / "narrow.npz")
    with pytest.raises(InputError, match=r"narrow\.npz: has a knot span narrower than 1e-100"):
        fuzzing.check(tmp_path / "narrow.npz")


def test_an_end_knot_too_many_is_refused(tmp_path):
    """Found by the fuzzer: a division by zero in the certificate."""
    volume = fuzzing.bent(3, 1)
    held = good_arrays(BSplineVolume) | {"degrees": np.array(volume.degrees), "control_points": volume.control_points}
    held |= {f"knots_{axis}": knots for axis, knots in zip("uvw", volume.knots, strict=True)}
    save_arrays(tmp_path / "end.npz", **held | {"knots_w": np.array([0.0, 0.0, 0.0, 1.0, 1.0])})
    with pytest.raises(InputError, match="must be repeated 2 times, not more"):
        fuzzing.check(tmp_path / "end.npz")


def test_corners_too_far_to_measure_are_refused(tmp_path):
    """Found by the fuzzer: numpy warned of an overflow."""
    path = tmp_path / "corners.json"
    path.write_text(json.dumps([[1e308, 0, 0]] * 8))
    with pytest.raises(InputError, match=r"finite and at most 1e\+100 in magnitude, found 1e\+308"):
        read_corners(path)


ANY_ARRAY = arrays.arrays(
    dtype=st.sampled_from([np.float64, np.float32, np.int64, np.uint8, np.bool_, np.complex128, np.dtype("U3")]),
    shape=arrays.array_shapes(min_dims=0, max_dims=5, min_side=0, max_side=4),
)


@QUICK
@given(data=st.data())
@pytest.mark.parametrize("kind", [BSplineVolume, SplineField, BoundaryMap])
def test_arrays_of_any_kind_are_read_or_refused(kind, data, tmp_path):
    """In place of one array of a good file, or of all."""
    path = tmp_path / "file.npz"
    names = {
        BSplineVolume: ("degrees", "knots_u", "knots_v", "knots_w", "control_points"),
        SplineField: ("degrees", "knots_u", "knots_v", "knots_w", "coefficients"),
        BoundaryMap: ("vertices", "parameters", "faces"),
    }[kind]
    held = good_arrays(kind)
    for name in data.draw(st.lists(st.sampled_from(names), min_size=1, max_size=len(names))):
        held[name] = data.draw(ANY_ARRAY)
    save_arrays(path, **held)
    try:
        kind.load(path)
    except ValueError as error:
        assert str(error).startswith(f"{path}: ")


def good_arrays(kind):
    volume = fuzzing.bent(3, 2)
    spline = {"degrees": np.array(volume.degrees)}
    spline |= {f"knots_{axis}": knots for axis, knots in zip("uvw", volume.knots, strict=True)}
    if kind is BSplineVolume:
        return spline | {"control_points": volume.control_points}
    if kind is SplineField:
        return spline | {"coefficients": volume.control_points[..., 0]}
    cube = fuzzing.cube()
    return {"vertices": cube.vertices, "parameters": cube.vertices, "faces": cube.faces}


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=30,
)


@QUICK
@given(content=JSON | st.lists(st.integers() | st.floats(), min_size=8, max_size=8))
def test_corners_of_any_content_are_read_or_refused(content, tmp_path):
    path = Path(tmp_path, "corners.json")
    path.write_text(json.dumps(content))
    try:
        corners = read_corners(path)
    except InputError as error:
        assert str(error).startswith(f"{path}: ")
    else:
        assert corners.shape in ((8,), (8, 3)) and np.all(np.isfinite(corners))


POINT = (0.3, -0.7, 1.9)
ONES = {"sin": math.sin, "cos": math.cos, "tanh": math.tanh, "abs": abs}
LEAVES = st.sampled_from([("x", POINT[0]), ("y", POINT[1]), ("z", POINT[2]), ("pi", math.pi), ("e", math.e)]) | (
    st.floats(-9.0, 9.0, allow_subnormal=False).map(lambda number: (f"({number!r})", number))
)


def larger(inner):
    """Sums, differences, products, squares and functions of formulas, each with its value at POINT."""
    pairs = st.tuples(inner, inner)
    return (
        pairs.map(lambda p: (f"({p[0][0]}+{p[1][0]})", p[0][1] + p[1][1]))
        | pairs.map(lambda p: (f"({p[0][0]}-{p[1][0]})", p[0][1] - p[1][1]))
        | pairs.map(lambda p: (f"{p[0][0]}*{p[1][0]}", p[0][1] * p[1][1]))
        | inner.map(lambda a: (f"({a[0]})**2", a[1] ** 2))
        | inner.map(lambda a: (f"(-{a[0]})", -a[1]))
        | st.tuples(st.sampled_from(sorted(ONES)), inner).map(lambda p: (f"{p[0]}({p[1][0]})", ONES[p[0]](p[1][1])))
    )


@QUICK
@given(formula=st.recursive(LEAVES, larger, max_leaves=12))
def test_a_formula_has_the_value_of_its_parts(formula):
    text, value = formula
    assert Expression(text)(*POINT) == pytest.approx(value, rel=1e-9, abs=1e-9)


@settings(QUICK, max_examples=200)
@given(
    text=st.text(alphabet="xyzpie0123456789.+-*/()^, sincotagqrlhbx_j\u00e4\0\n'", max_size=40) | st.text(max_size=30)
)
def test_any_text_is_a_formula_or_refused(text):
    try:
        expression = Expression(text)
    except ExpressionError as error:
        assert "\n" not in str(error)
    else:
        assert expression(0.5, 0.5, 0.5).shape == ()
