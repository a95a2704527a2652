from __future__ import annotations

import pytest

from iga_nn.errors import InputError
from iga_nn.live.page_form import described, filled, in_words, stated
from iga_nn.options import PROBLEMS, ElasticityOptions, PoissonOptions

KEPT = PoissonOptions(exact="x", refine=(0,))


def test_an_empty_form_is_the_default_problem_on_the_pages_own_meshes():
    assert stated({"exact": "", "face u0": ""}, KEPT) == PoissonOptions(refine=(0,))


def test_a_form_states_coefficient_source_and_data_of_faces():
    form = {"kappa": " 1+x*x ", "source": "1", "boundary": "y", "reaction": "2"}
    form |= {"face u1": "on", "kind u1": "flux", "data u1": "x*y"}
    form |= {"face w0": "on", "kind w0": "exchange", "alpha w0": "3", "data w0": "z"}
    form |= {"kind v0": "flux", "data v0": "its box is not checked"}
    found = stated(form, KEPT)
    assert (found.kappa, found.source, found.boundary, found.reaction) == ("1+x*x", "1", "y", "2")
    assert found.exact is None and found.refine == (0,)
    assert (found.neumann, found.robin) == (("u1=x*y",), ("w0=3:z",))


def test_empty_data_of_a_face_follow_from_the_exact_solution():
    form = {"exact": "x*y", "face u1": "on", "face v0": "on", "kind v0": "exchange", "alpha v0": "2"}
    found = stated(form, KEPT)
    assert (found.neumann, found.robin) == (("u1",), ("v0=2",))


@pytest.mark.parametrize(
    ("form", "says"),
    [
        ({"kappa": "import os"}, "kappa"),
        ({"source": "1", "face u0": "on"}, "u0"),
        ({"face u0": "on", "kind u0": "exchange"}, "face u0: give α"),
    ],
)
def test_data_that_cannot_be_solved_with_are_refused_by_name(form, says):
    with pytest.raises(InputError, match=says):
        stated(form, KEPT)


def test_the_form_lists_the_options_of_each_problem_and_the_faces():
    known = described()
    assert [problem["name"] for problem in known["problems"]] == list(PROBLEMS)
    for problem in known["problems"]:
        own = [field["name"] for field in problem["fields"] + problem["lists"] + problem["more"]]
        assert set(own) <= set(PROBLEMS[problem["name"]].__dataclass_fields__)
        assert len(set(own)) == len(own)
    assert [face["name"] for face in known["faces"]] == ["u0", "u1", "v0", "v1", "w0", "w1"]


def test_asks_stand_one_a_line_and_are_refused_by_name():
    form = {"exact": "x", "ask": "u at (0.5, 0.5, 0.5)\n\nintegral u", "unit": "mm"}
    found = stated(form, KEPT)
    assert found.ask == ("u at (0.5, 0.5, 0.5)", "integral u") and filled(found)["ask"].count("\n") == 1
    with pytest.raises(InputError, match="nonsense"):
        stated({"exact": "x", "ask": "nonsense"}, KEPT)


def test_every_list_of_regions_is_seen_or_one_of_the_more():
    for problem in described()["problems"]:
        names = [field["name"] for field in problem["lists"] + problem["more"]]
        assert names and sorted(names) == sorted(PROBLEMS[problem["name"]].on_regions())
        assert 2 <= len(problem["lists"]) <= 5


def test_lists_of_regions_have_an_entry_a_line():
    problem = PoissonOptions(exact="x", value=("face(0,0,1)=x", "nx > 0.9=0"), refine=(0,))
    assert filled(problem) == {"problem": "poisson", "exact": "x", "value": "face(0,0,1)=x\nnx > 0.9=0"}
    form = {"exact": "x", "value": " face(0,0,1)=x \r\n\n nx > 0.9=0\n", "flux": " \n"}
    assert stated(form, PoissonOptions(refine=(0,))) == problem
    assert in_words(problem) == "u = x, value on face(0,0,1)=x, nx > 0.9=0"


BODY = {"problem": "elasticity", "fix": "nz < -0.9", "load": "face(0,0,3)=0;0;-2\r\nu1=1;0;0", "unit": "mm"}


def test_a_form_states_an_elastic_body_on_the_pages_own_meshes():
    found = stated(BODY | {"young": "210e3", "stress_unit": "MPa", "kappa": "of the other problem"}, KEPT)
    assert found == ElasticityOptions(
        young=210e3,
        fix=("nz < -0.9",),
        load=("face(0,0,3)=0;0;-2", "u1=1;0;0"),
        unit="mm",
        stress_unit="MPa",
        refine=(0,),
    )
    assert stated(filled(found), KEPT) == found
    assert (
        in_words(found)
        == "an elastic body, E = 210000, ν = 0.3, fix on nz < -0.9, load on face(0,0,3)=0;0;-2, u1=1;0;0"
    )
    assert stated(BODY, found).young == 1.0  # an empty field, whatever was solved before


def test_a_form_states_loads_in_total_and_forces_of_the_mass():
    loads = {"total_force": "bore 1=0;0;-5", "remote_force": "u1=0;0;1 at (1, 2, 3)", "spin": "0;0;1 at (0, 0, 0)"}
    found = stated(BODY | loads | {"density": "7.85e-9"}, KEPT)
    assert found.total_force == ("bore 1=0;0;-5",) and found.remote_force == ("u1=0;0;1 at (1, 2, 3)",)
    assert stated(filled(found), KEPT) == found and "total force on bore 1=0;0;-5" in in_words(found)
    body = next(one for one in described()["problems"] if one["name"] == "elasticity")
    after = {one["name"]: (one["empty"], one["after"]) for one in body["lists"] + body["more"]}
    assert after["moment"] == ("REGION=VECTOR, one a line", "=0;0;0")
    assert after["remote_force"] == ("REGION=VECTOR at POINT, one a line", "=0;0;0 at (0, 0, 0)")


@pytest.mark.parametrize(
    ("form", "says"),
    [
        ({"young": "stiff"}, "Young's modulus E: give a number, such as 1, got 'stiff'"),
        ({"young": "-1"}, "young"),
        ({"poisson_ratio": "0.5"}, "poisson_ratio"),
        ({"load": "nz > 0.9"}, "load 'nz > 0.9'"),
        ({"fix": "", "load": ""}, "nothing acts on the body"),
        ({"fix": "nz >"}, "nz >"),
        ({"problem": "plasticity"}, "problem 'plasticity': choose one of poisson, elasticity"),
    ],
)
def test_a_body_that_cannot_be_solved_is_refused_in_one_line(form, says):
    with pytest.raises(InputError) as refused:
        stated(BODY | form, KEPT)
    assert says in str(refused.value) and "\n" not in str(refused.value)


def test_a_form_without_faces_leaves_the_data_of_the_faces():
    kept = PoissonOptions(source="1", neumann=("u1=0",), robin=("w0=3:0",))
    assert stated({"source": "2"}, kept, has_faces=False) == PoissonOptions(
        source="2", neumann=("u1=0",), robin=("w0=3:0",)
    )


def test_a_form_is_filled_with_what_it_has_stated():
    problem = PoissonOptions(
        kappa="1+X*X", source="1", exact="0", neumann=("u1", "v0=x*y"), robin=("w0=3:z", "w1=2"), refine=(0,)
    )
    assert filled(problem)["data w0"] == "z" and "boundary" not in filled(problem)
    assert stated(filled(problem), KEPT) == problem
    assert filled(PoissonOptions()) == {"problem": "poisson"}


def test_jobs_are_told_apart_by_their_problems():
    problem = PoissonOptions(kappa="1+X*X", source="1", neumann=("u1=0",), robin=("w0=3:z",))
    assert in_words(problem) == "κ = 1+X*X, f = 1, flux on u1: 0, exchange on w0: z"
    assert in_words(PoissonOptions()) == "the problem of an empty form"
