import pickle

import pytest

import iga_nn
from solve.ask import Ask, asks_of
from solve.forms.parser import ExpressionError


@pytest.mark.parametrize(
    ("text", "kind", "quantity", "region"),
    [
        ("ux at (10, 0, -0.5)", "at", "ux", None),
        ("T at 10,0,0", "at", "T", None),
        ("von_mises max over nz > 0.9 and x < 2", "max", "von_mises", "nz > 0.9 and x < 2"),
        ("min  u", "min", "u", None),
        ("mean T over group:inlet", "mean", "T", "group:inlet"),
        ("integral u over face(1, 2, 3)", "integral", "u", "face(1, 2, 3)"),
        ("reaction z of u0 or u1", "reaction", "", "u0 or u1"),
        ("flow over x < 1", "flow", "", "x < 1"),
        ("energy", "energy", "", None),
    ],
)
def test_each_form_is_read(text, kind, quantity, region):
    ask = Ask(text)
    assert (ask.kind, ask.quantity) == (kind, quantity)
    assert (None if ask.region is None else str(ask.region)) == region


def test_places_directions_and_numbers_are_read():
    assert Ask("uz at (10, 0, -.5)").place == (10.0, 0.0, -0.5)
    assert Ask("reaction z of u0").direction == "z" and Ask("reaction of u0").direction == ""
    assert Ask("frequency 12").number == 12


def test_a_position_alone_is_a_part_of_the_body():
    assert not Ask("u max over x < 1 and box(0, 0, 0, 1, 1, 1)").is_on_boundary
    for region in ("nz > 0.9", "u0", "p2_u0", "group:a", "face(1, 2, 3)"):
        assert Ask(f"u max over {region}").is_on_boundary


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; write 'ux at"),
        ("von_mises", "neither where nor what of 'von_mises'"),
        ("u at (1, 2)", "a place is three numbers"),
        ("u at (1, 2, nan)", "must be finite"),
        ("u max over foo < 1", "region 'foo < 1': .*unknown name"),
        ("u max over", "is no ask"),
        ("reaction z", "a reaction has a region, as in 'reaction z of u0'"),
        ("flow", "a flow has a region"),
        ("frequency", "the number of its mode"),
        ("frequency 0", "the first one is frequency 1"),
    ],
)
def test_a_bad_text_has_one_line(text, message):
    with pytest.raises(ExpressionError, match=message) as refused:
        Ask(text)
    assert "\n" not in str(refused.value) and str(refused.value).startswith("ask ")


def test_an_ask_has_no_other_kind():
    with pytest.raises(ExpressionError, match="ask must be text"):
        Ask(3)  # type: ignore[arg-type]
    with pytest.raises(ExpressionError, match="a list of texts"):
        asks_of(3)
    with pytest.raises(ExpressionError, match="asked twice"):
        asks_of(["u max", Ask("u  max")])


def test_a_copy_is_the_same():
    ask = iga_nn.Ask("mean u over z > 1")
    copy = pickle.loads(pickle.dumps(ask))
    assert copy == ask and copy.kind == "mean" and str(copy.region) == "z > 1"
