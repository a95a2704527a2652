"""Tests the library of materials and their units."""

import pytest

import iga_nn
from solve.forms.library import MATERIALS


def test_a_material_is_found_by_any_of_its_names():
    assert iga_nn.material("Steel") is iga_nn.material("S235") is iga_nn.material("structural steel")
    assert iga_nn.material("nylon").name == "PA66"
    with pytest.raises(ValueError, match="do you mean 'titanium'"):
        iga_nn.material("titanum")


def test_every_number_of_the_library_has_a_source_and_a_usual_size():
    names = [name for one in MATERIALS for name in (one.name, *one.other_names)]
    assert len(set(map(str.lower, names))) == len(names)
    for one in MATERIALS:
        assert one.source and one.unit == "mm"
        assert 0.5e-9 / 1.2 < one.density < 10e-9
        assert one.yield_strength is None or 20.0 < one.yield_strength < 1000.0


def test_metres_are_exact_and_lead_back():
    for one in MATERIALS:
        assert one.in_unit("m").in_unit("mm") == one
    steel = iga_nn.material("steel").in_unit("m")
    assert (steel.young, steel.density, steel.conductivity, steel.yield_strength) == (2.1e11, 7850.0, 53.3, 2.35e8)
    with pytest.raises(ValueError, match="'mm' or 'm', got 'in'"):
        steel.in_unit("in")


def test_orthotropic_constants_come_in_threes():
    with pytest.raises(ValueError, match="E1, E2, E3"):
        iga_nn.Material("half", young=(1.0, 1.0, 1.0), poisson_ratio=0.3)
