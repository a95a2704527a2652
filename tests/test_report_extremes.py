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
    assert extremes.growth_notices({"levels": levels * 2}) == []


def test_of_a_stress_on_one_level_it_is_said_that_its_growth_is_unknown():
    (notice,) = extremes.growth_notices({"levels": [level(1.0, von_mises=100.0)]})
    assert "known on one level alone" in notice and "at (12.5, 0, 3.1)" in notice and "--refine 0 1" in notice
    assert extremes.growth_notices({"levels": [level(1.0, gradient_magnitude=100.0)]}) == []


@pytest.mark.parametrize(
    ("fine", "grows"),
    [(level(0.5, von_mises=109.0), False), (level(0.5, von_mises=111.0), True), (level(0.25, von_mises=120.0), False)],
)
def test_growth_is_that_of_a_halved_h(fine, grows):
    notices = extremes.growth_notices({"levels": [level(1.0, von_mises=100.0), fine], "stress_unit": "MPa"})
    assert bool(notices) == grows
    if grows:
        assert (
            "grew from 100 to 111 MPa under" in notices[0]
            and "at (12.5, 0, 3.1)" in notices[0]
            and "infinite" in notices[0]
        )
