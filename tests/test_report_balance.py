"""What acts on a body and what holds it, in words and as a table."""

from __future__ import annotations

from iga_nn.report.balance import heading, lines, table

LEVEL = {
    "load": [0.0, 1e-9, -2.0],
    "reactions": {"fix 'u0'": [-0.25, 0.0, 1.5], "spring 'nx > 0.9'": [0.25, 0.0, 0.5]},
    "areas": {},
    "imbalance": 3.2e-9,
}
BODY = {"levels": [{"load": [9.0] * 3, "reactions": {}}, LEVEL]}


def test_forces_are_told_of_the_finest_level():
    assert lines(BODY) == [
        "load (0, 0, -2)",
        "fix 'u0' answers (-0.25, 0, 1.5)",
        "spring 'nx > 0.9' answers (0.25, 0, 0.5)",
    ]
    assert heading(BODY) == "What holds the body"
    assert table(BODY) == [
        ["", "x", "y", "z"],
        ["Load", "0", "0", "-2"],
        ["Fix 'u0'", "-0.25", "0", "1.5"],
        ["Spring 'nx > 0.9'", "0.25", "0", "0.5"],
        ["Imbalance, relative", "3.2e-09", "", ""],
    ]


def test_forces_have_a_unit_where_those_of_stresses_and_lengths_are_known():
    known = BODY | {"unit": "in", "stress_unit": "ksi"}
    assert lines(known)[0] == "load (0, 0, -2) ksi·in²"
    assert table(known)[0] == ["", "x [ksi·in²]", "y [ksi·in²]", "z [ksi·in²]"]
    for stress, length in (("MPa", "mm"), ("Pa", "m"), ("N/mm²", "mm")):
        assert lines(BODY | {"unit": length, "stress_unit": stress})[0] == "load (0, 0, -2) N"
    assert lines(BODY | {"unit": "m", "stress_unit": "MPa"})[0] == "load (0, 0, -2) MPa·m²"
    assert lines(BODY | {"unit": "mm"}) == lines(BODY)


def test_moments_are_told_in_newtons_times_lengths():
    moments = {"load": [0.0, -20.0, 1e-9], "reactions": {"fix 'u0'": [0.0, 20.0, 0.0]}}
    section = {"unit": "mm", "stress_unit": "MPa", "levels": [LEVEL | {"moments": moments}]}
    assert lines(section)[-1] == "moments about the origin in N·mm: load (0, -20, 0), fix 'u0' (0, 20, 0)"
    assert table(section)[-3] == ["Moment about the origin, load [N·mm]", "0", "-20", "0"]
    assert "in MPa·m³" in lines(section | {"unit": "m"})[-1]
    assert lines(BODY | {"levels": section["levels"]})[-1].startswith("moments about the origin: load (0, -20, 0)")


def test_of_a_scalar_law_what_flows_in_is_told():
    heat = {"unit": "mm", "levels": [{"load": [3.0], "reactions": {"value 'u0'": [-3.0]}}]}
    assert lines(heat) == ["load 3", "value 'u0' answers -3"] and heading(heat) == "What flows into the body"
    assert table(heat) == [["", "inflow"], ["Load", "3"], ["Value 'u0'", "-3"]]


def test_values_on_the_faces_of_many_patches_are_one_sum():
    each = {f"p{i}_u0": [0.5] for i in range(7)} | {"flux 'z < 1'": [1.0]}
    heat = {"levels": [{"load": [-4.5], "reactions": each}]}
    assert lines(heat) == ["load -4.5", "data on 7 faces answers 3.5", "flux 'z < 1' answers 1"]


def test_what_older_reports_lack_is_not_told():
    for section in ({}, {"levels": []}, {"levels": [{"dofs": 8}]}, {"levels": [{"load": [1.0], "reactions": {}}]}):
        assert lines(section) == table(section) == []
