"""Units in the text of STEP and IGES, without OpenCASCADE."""

from __future__ import annotations

import pytest
from iges_files import parameters, section
from step_files import Step, converted, metric

from parameterize.surface.readers.cad_units import iges_unit, step_unit
from parameterize.surface.surface import MeshError

INCH = converted("INCH", 25.4)


def boxes(*contexts):
    """A file of a box in each of these contexts."""
    step = Step(*contexts[0])
    for lengths in contexts:
        context = step.units(*lengths) if lengths is not contexts[0] else step.context
        step.part(step.box(), context=context)
    return step.data()


@pytest.mark.parametrize(
    ("lengths", "name", "millimetres"),
    [
        (metric(), "m", 1e3),
        (metric("KILO"), "km", 1e6),
        (metric("HECTO"), "hm", 1e5),
        (metric("DECA"), "dam", 1e4),
        (metric("DECI"), "dm", 1e2),
        (metric("CENTI"), "cm", 1e1),
        (metric("MILLI"), "mm", 1.0),
        (metric("MICRO"), "micron", 1e-3),
        (metric("NANO"), "nm", 1e-6),
        (INCH, "in", 25.4),
        (converted("INCH", 2.54, metric("CENTI")), "in", 25.4),
        (converted("inches", 0.0254, metric()), "in", 25.4),
        (converted("FOOT", 304.8), "ft", 304.8),
        (converted("YARD", 914.4), "yd", 914.4),
        (converted("MILE", 1609344), "mi", 1609344.0),
        (converted("MIL", 0.0254), "mil", 0.0254),
        (converted("", 2.54e-5), "microinch", 2.54e-5),
    ],
)
def test_the_unit_of_a_step_file_is_found_by_its_length(lengths, name, millimetres):
    found = step_unit(boxes(lengths))
    assert (found.name, found.notices) == (name, ()) and found.millimetres == pytest.approx(millimetres, rel=1e-12)
    assert found.working == pytest.approx(min(1.0, millimetres))
    assert found.factor * found.working == pytest.approx(millimetres)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (boxes(converted("US SURVEY FOOT", 304.8006096)), "the file's unit, 'US SURVEY FOOT' of 304.801 mm"),
        (boxes(metric("MILLI"), INCH), "several units (in, mm)"),
        (boxes(converted("FURLONG", 201168), metric()), "several units (FURLONG, m)"),
        (b"ISO-10303-21;\nDATA;\n", "names no unit"),
        (boxes(metric("BOGUS")), "names no unit"),
        (boxes(converted("INCH", 0)), "names no unit"),
    ],
)
def test_without_one_unit_that_has_a_name_lengths_are_in_mm_with_a_notice(data, says):
    found = step_unit(data)
    (notice,) = found.notices
    assert (
        (found.name, found.millimetres) == ("mm", 1.0) and notice.startswith("lengths are in mm: ") and says in notice
    )


@pytest.mark.parametrize("size", [b"25.4", b"2.54E+01", b" POSITIVE_LENGTH_MEASURE ( 25.4 ) "])
def test_the_size_of_a_unit_is_written_in_several_ways(size):
    data = boxes(INCH)
    assert data.count(b"LENGTH_MEASURE(25.4)") == 1
    assert step_unit(data.replace(b"LENGTH_MEASURE(25.4)", size)).name == "in"


def test_the_unit_is_that_of_the_solids():
    """Not that of annotations or of measures, nor one in a comment."""
    step = Step(*metric("CENTI"))
    step.part(step.box())
    step.part(step.point((0, 0, 0)), kind="SHAPE_REPRESENTATION", context=step.units(*INCH))
    step.add("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.),#2)")
    assert step_unit(step.data()).name == "cm"
    spaced = (
        step.data().replace(b".CENTI.,.METRE.", b"\n.CENTI. /* .MILLI. ; */ , .METRE.").replace(b"'part'", b"'a;/*#9='")
    )
    assert step_unit(spaced).name == "cm"


def test_equal_units_of_many_contexts_are_one():
    assert step_unit(boxes(INCH, converted("INCH", 2.54, metric("CENTI")), INCH)).name == "in"


def test_a_unit_of_a_converted_unit_is_refused():
    """OpenCASCADE would take a foot of twelve inches for a millimetre."""
    with pytest.raises(MeshError, match="its unit 'FOOT' is given in a unit that is no SI unit"):
        step_unit(boxes(converted("FOOT", 12, INCH)))


@pytest.mark.parametrize(
    ("flag", "name", "unit", "millimetres"),
    [
        ("1", "2HIN", "in", 25.4),
        ("1", "4HINCH", "in", 25.4),
        ("2", "2HMM", "mm", 1.0),
        ("3", "2HCM", "cm", 10.0),
        ("3", "4HINCH", "in", 25.4),
        ("0", "2HFT", "ft", 304.8),
        ("4", "2HFT", "ft", 304.8),
        ("5", "2HMI", "mi", 1609344.0),
        ("6", "1HM", "m", 1e3),
        ("7", "2HKM", "km", 1e6),
        ("8", "3HMIL", "mil", 0.0254),
        ("9", "2HUM", "micron", 1e-3),
        ("10", "2HCM", "cm", 10.0),
        ("11", "3HUIN", "microinch", 2.54e-5),
        ("6", "2HMM", "m", 1e3),  # the flag has the last word
        ("7", "", "km", 1e6),
        ("", "", "in", 25.4),  # by default
        ("3", "2HYD", "yd", 1.0),  # OpenCASCADE leaves numbers in a unit that it does not know as they are
    ],
)
def test_the_unit_of_an_iges_file(flag, name, unit, millimetres):
    found = iges_unit(section(parameters(flag, name)).encode())
    assert (found.name, found.notices) == (unit, ()) and found.millimetres == pytest.approx(millimetres)


@pytest.mark.parametrize("start", [("", ""), ("1H,", "1H;"), ("1H/", "1H#"), ("1H|", "")])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_the_section_may_have_its_own_delimiters_and_ends_of_lines(start, newline):
    data = section(parameters("7", "2HKM", start=start)).replace("\n", newline).encode()
    assert iges_unit(data).name == "km"


def test_an_iges_unit_without_a_name_that_is_known_is_told():
    lost, none = (iges_unit(section(parameters("3", name)).encode()) for name in ("5HCUBIT", ""))
    assert lost.notices == ("lengths are taken as mm: its unit 'CUBIT' is not known",)
    assert none.notices == ("lengths are taken as mm: the file names no unit",)
    assert lost.name == none.name == "mm" and lost.millimetres == 1.0


@pytest.mark.parametrize("flag", ["12", "-1", "2.5", "MM"])
def test_a_flag_that_is_none_of_iges_is_refused(flag):
    with pytest.raises(MeshError, match=f"the flag '{flag}' of its unit is none of IGES"):
        iges_unit(section(parameters(flag)).encode())


def test_a_scale_of_the_model_space_is_told():
    assert iges_unit(section(parameters(scale="0.5D0")).encode()).notices == (
        "the file's model space scale of 0.5 is not applied",
    )


def test_a_file_without_a_section_of_parameters_is_refused():
    with pytest.raises(MeshError, match="has no section G"):
        iges_unit(b"hello\n")
