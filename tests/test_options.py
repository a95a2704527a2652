from __future__ import annotations

from dataclasses import fields, replace

import pytest

from iga_nn.options import PROBLEMS, ElasticityOptions, MapOptions, PoissonOptions

SPACE = {"refine": (2,), "degree": 2, "quadrature": "gauss"}
SCALAR = dict.fromkeys(("exact", "source", "boundary", "kappa", "reaction"), "1")
VECTOR = dict.fromkeys(("exact", "body_force", "displacement"), "1;1;1")
OTHERS = {
    PoissonOptions(source="2"): SPACE | SCALAR | {"neumann": ("u1=1",), "robin": ("u1=1:1",)},
    ElasticityOptions(body_force="2;2;2"): SPACE
    | VECTOR
    | {"traction": ("u1=1;1;1",), "young": 2.0, "poisson_ratio": 0.25},
}


def told(options):
    """What a solve is told of the options; `run` and `solve` ask for the same."""
    return options.problem(), options.solver(), options.refine


@pytest.mark.parametrize(("options", "others"), OTHERS.items(), ids=lambda given: getattr(given, "section", ""))
def test_every_option_of_a_problem_is_told_to_the_solver(options, others):
    for field in fields(options):
        assert told(replace(options, **{field.name: others[field.name]})) != told(options), field.name


def test_shared_options_leave_the_order_of_the_own_ones():
    assert MapOptions("paper", 3).seed == 3 and PoissonOptions("x", "1").source == "1"


def test_every_problem_is_tested_here():
    assert {type(options) for options in OTHERS} == set(PROBLEMS.values())
