"""Tests the options of materials: names, units, axes, and options that do nothing."""

import pickle
from dataclasses import replace
from pathlib import Path

import pytest

import iga_nn
from iga_nn import ElasticityOptions, PlasticOptions
from iga_nn.errors import InputError
from iga_nn.live.page_form import filled, stated
from iga_nn.options.analysis import ModesOptions
from iga_nn.options.materials import listed
from solve.forms.library import MATERIALS

LOADED = {"fix": ("u0",), "load": ("u1=1;0;0",)}


def options(**how):
    return iga_nn.ElasticityOptions(**{**LOADED, **how})


def test_a_material_has_its_numbers_and_units():
    steel = options(material="steel", gravity="0;0;-9810")
    body = steel.problem()
    assert (body.young, body.yield_strength, body.density) == (210000.0, 235.0, 7.85e-9)
    assert (steel.units.displacement, steel.units.stress) == ("mm", "MPa")
    assert options(material="steel", unit="m").problem().young == 2.1e11
    told = steel.values()
    assert told["unit"] == "mm" and told["young"] is None
    assert told["materials"][0]["source"].startswith("S235")
    rows = dict(iga_nn.ElasticityOptions.law_of(told))
    assert rows["material steel"].startswith("E = 210000, ν = 0.3, ρ = 7.85e-09")


def test_each_solid_has_its_material():
    body = options(material="body: steel, pad: CFRP", first_axis="1;1;0").problem()
    assert body.young == {"body": 210000.0, "pad": (126000.0, 11000.0, 11000.0)}
    assert body.shear_modulus["body"] is None and body.yield_strength["pad"] is None


def test_orthotropic_constants_are_read_with_semicolons():
    how = {"young": "126;11;11", "poisson_ratio": "0.28;0.28;0.4", "shear_modulus": "6.6;6.6;3.93"}
    assert options(**how, first_axis="u").problem().hooke.young == (126.0, 11.0, 11.0)


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ({"material": "steel", "young": 3.0}, "--material and --young: give one of them"),
        ({"material": "steel", "alpha": 1e-5}, "--material and --alpha: give one of them"),
        ({"material": "stel"}, "do you mean 'steel'"),
        ({"material": "steel", "unit": "in"}, "--unit in is neither: write --unit mm --stress-unit MPa"),
        ({"material": "steel", "unit": "m", "stress_unit": "MPa"}, "--unit m --stress-unit MPa is neither"),
        ({"alpha": 1e-5}, "--alpha does nothing without a temperature"),
        ({"temperature_change": "20"}, "--temperature-change needs the thermal strain per kelvin"),
        ({"material": "steel", "first_axis": "1;0;0"}, "--first-axis does nothing"),
        ({"material": "spruce", "first_axis": "1;1;0"}, "second_axis is needed"),
        ({"young": "1;2"}, "give one number, or three with semicolons"),
        ({"young": "1;2;3"}, "E1, E2, E3"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(how, line):
    with pytest.raises(iga_nn.InputError, match=line):
        options(**how).problem()


def test_a_temperature_without_a_solution_is_refused(tmp_path):
    with pytest.raises(iga_nn.InputError, match="solution.npz is not there"):
        options(material="steel", temperature_change=str(tmp_path)).problem()


def test_heat_is_conducted_as_the_material_does():
    law = iga_nn.PoissonOptions(material="steel", value=("u0=0",), source="1")
    assert law.problem().data["kappa"].formulas[0].text == "0.0533"
    for how, line in (("spruce", "give --kappa as a tensor"), ("CFRP", "not known: give --kappa")):
        with pytest.raises(iga_nn.InputError, match=line):
            iga_nn.PoissonOptions(material=how, source="1")
    with pytest.raises(iga_nn.InputError, match="--material and --kappa"):
        iga_nn.PoissonOptions(material="steel", kappa="1", source="1")


def test_vibrations_take_the_density_of_the_material():
    assert ModesOptions(material="steel").densities == 7.85e-9
    assert ModesOptions(material="steel", unit="m").densities == 7850.0
    assert ModesOptions().densities == 1.0
    assert ModesOptions(material="steel", density=1.0).densities == 1.0
    with pytest.raises(iga_nn.InputError, match="the material has its own"):
        ModesOptions(material="steel", young=3.0).problem()


def test_the_library_is_listed_with_its_sources():
    lines = listed().splitlines()
    assert lines[2].split() == ["steel", "210000", "0.3", "7.85e-09", "1.2e-05", "0.0533", "235"]
    assert "S235" in lines[-17]


def test_the_page_has_the_numbers_of_the_library():
    page = (Path(__file__).parents[1] / "docs" / "materials.md").read_text(encoding="utf-8")
    for one in MATERIALS:
        assert f"| `{one.name}` | {_shown(one.young)} | {_shown(one.poisson_ratio)} |" in page
        assert f"| {', '.join(one.other_names) or '–'} | {one.source} |" in page


def _shown(value):
    return "; ".join(f"{part:.5g}" for part in value) if isinstance(value, tuple) else f"{value:.5g}"


@pytest.mark.parametrize("kind", [ElasticityOptions, PlasticOptions, ModesOptions])
def test_a_number_given_beside_a_material_is_refused_even_if_it_is_the_default(kind):
    with pytest.raises(InputError, match="--material and --young: give one of them"):
        kind(material="steel", young=1.0, **({} if kind is ModesOptions else LOADED)).problem()
    with pytest.raises(InputError, match="--material and --poisson-ratio: give one of them"):
        kind(material="steel", poisson_ratio=0.3, **({} if kind is ModesOptions else LOADED)).problem()
    assert kind().young == 1.0 and replace(pickle.loads(pickle.dumps(kind())), material="steel").young == 1.0


def test_a_form_with_a_material_has_empty_constants():
    sheet = {"problem": "elasticity", "material": "steel", "fix": "u0", "load": "u1=0;0;1"}
    found = stated(sheet, ElasticityOptions(fix=("u0",)))
    assert found.material == "steel" and "young" not in filled(found)
    with pytest.raises(InputError, match="--material and --young"):
        stated(sheet | {"young": "1"}, ElasticityOptions())
