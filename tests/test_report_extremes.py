"""Extremes in words, and the notice of a stress that grows."""

import pytest

from iga_nn.report import extremes

AT = [12.5, 1e-9, 3.1]


def level(h, **largest):
    found = {
        name: {"least": -1.0, "least_at": [0.0, 0.0, 1.0], "largest": v, "largest_at": AT}
        for name, v in largest.items()
    }
    return {"h": h, "dofs": int(1000 / h), "extremes": found}


def section(**given):
    return {
        "levels": [level(1.0, magnitude=0.012, von_mises=159.0), level(0.5, magnitude=0.0123, von_mises=160.0)],
        **given,
    }


def test_levels_stand_beside_each_other_with_the_place():
    assert extremes.lines(section()) == [
        "largest displacement 0.012 → 0.0123 at (12.5, 0, 3.1)",
        "von Mises at most 159 → 160 at (12.5, 0, 3.1)",
    ]
    assert extremes.table(section())[0] == ["", "1,000 unknowns", "2,000 unknowns", "where"]


def test_units_stand_behind_numbers_and_places():
    assert extremes.lines(section(unit="mm", stress_unit="MPa")) == [
        "largest displacement 0.012 → 0.0123 mm at (12.5, 0, 3.1) mm",
        "von Mises at most 159 → 160 MPa at (12.5, 0, 3.1) mm",
    ]


def test_least_and_largest_value_of_a_scalar():
    assert extremes.lines({"levels": [level(1.0, u=2.0, gradient_magnitude=3.0)]}) == [
        "u at least -1 at (0, 0, 1)",
        "u at most 2 at (12.5, 0, 3.1)",
        "|gradient| at most 3 at (12.5, 0, 3.1)",
    ]


@pytest.mark.parametrize("levels", [[], [{"h": 1.0, "dofs": 8}], [{"h": 1.0, "dofs": 8, "extremes": {}}]])
def test_reports_without_extremes(levels):
    assert extremes.lines({"levels": levels}) == extremes.table({"levels": levels}) == []
    assert extremes.peak_notices({"levels": levels * 2}) == []


def test_of_a_stress_on_one_level_it_is_said_that_its_growth_is_unknown():
    (notice,) = extremes.peak_notices({"levels": [level(1.0, von_mises=100.0)]})
    assert "known on one level alone" in notice and "at (12.5, 0, 3.1)" in notice and "--refine 0 1" in notice
    assert extremes.peak_notices({"levels": [level(1.0, gradient_magnitude=100.0)]}) == []


@pytest.mark.parametrize(
    ("fine", "grows"),
    [(level(0.5, von_mises=109.0), False), (level(0.5, von_mises=111.0), True), (level(0.25, von_mises=120.0), False)],
)
def test_growth_is_that_of_a_halved_h(fine, grows):
    notices = extremes.peak_notices({"levels": [level(1.0, von_mises=100.0), fine], "stress_unit": "MPa"})
    assert bool(notices) == grows
    if grows:
        assert (
            "grew from 100 to 111 MPa under" in notices[0]
            and "at (12.5, 0, 3.1)" in notices[0]
            and "infinite" in notices[0]
        )


RIM = {"kind": "rim", "text": "the rim of fix 'x < 1'", "at": AT, "radius": 0.8, "exponent": 0.5}


def at_rim(**more):
    """Return two levels whose stress is infinite at a rim, and known outside."""
    known = section(unit="mm", stress_unit="MPa")
    for one in known["levels"]:
        one["singular"] = [RIM]
        one["extremes"]["von_mises"] |= {"spans": 2.0, "radius": 0.8, "beside": True} | more
    return known


def test_where_stress_is_infinite_stands_first():
    assert extremes.lines(at_rim()) == [
        "stress is infinite at the rim of fix 'x < 1'",
        "largest displacement 0.012 → 0.0123 mm at (12.5, 0, 3.1) mm",
        "von Mises at most 159 → 160 MPa at (12.5, 0, 3.1) mm, farther than 2 spans (up to 0.8 mm) from there",
    ]
    assert extremes.table(at_rim())[1] == ["stress is infinite at", "∞", "∞", "the rim of fix 'x < 1'"]


def test_the_notice_names_the_place_and_the_stress_outside():
    (notice,) = extremes.peak_notices(at_rim())
    assert notice == (
        "the stress is infinite at the rim of fix 'x < 1', and what a mesh gives there is no result; von Mises at most "
        "160 MPa at (12.5, 0, 3.1) mm, farther than 2 spans (up to 0.8 mm) from there"
    )
    (notice,) = extremes.peak_notices(at_rim(spans=0.0))
    assert "all of this mesh" in notice and "160" not in notice


def test_growth_is_told_of_places_that_are_not_known():
    known = at_rim()
    known["levels"][1]["extremes"]["von_mises"]["largest"] = 300.0
    assert len(extremes.peak_notices(known)) == 1
    known["levels"][1]["extremes"]["von_mises"]["beside"] = False
    assert "grew from 159 to 300 MPa" in extremes.peak_notices(known)[1]


def test_without_singular_places_nothing_is_said():
    known = section()
    for one in known["levels"]:
        one["singular"] = []
    assert extremes.peak_notices(known) == []
    assert extremes.peak_notices({"levels": known["levels"][:1]}) == []
