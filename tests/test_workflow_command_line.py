from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from iga_nn.cli.commands import app
from iga_nn.options import ElasticityOptions, MapOptions, PoissonOptions, StudyOptions
from iga_nn.workflow.command_line import command_line


def options_of(line: str) -> tuple[object, ...]:
    """The options dataclasses that the command line makes of such a line."""
    program, *words = shlex.split(line)
    assert program == "iga-nn"
    _, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
    return tuple(bound.arguments.values())


@pytest.mark.parametrize(
    ("command", "chosen"),
    [
        ("run poisson", (MapOptions(seed=3, corners=Path("a b.json"), steps_factor=0.5), PoissonOptions())),
        ("solve poisson", (PoissonOptions(exact="-x*y", neumann=("u1=-y", "w0"), robin=("v0=1+x*x:2",)),)),
        ("solve poisson", (PoissonOptions(source="1", boundary="0", kappa="2,0,0,1,0,1", refine=(1, 2), degree=4),)),
        ("solve elasticity", (ElasticityOptions(body_force="0;0;-1", traction=("u1=1;0;0",), young=2.5),)),
        ("run elasticity", (MapOptions(seed=3), ElasticityOptions(exact="x;y;z", traction=("u1",)))),
        ("study elasticity", (ElasticityOptions(exact="x;y;z", traction=("u1", "v0"), young=2.5), StudyOptions((2,)))),
        ("study", (StudyOptions(degree=(2, 3), refine=("0..3",)),)),
    ],
)
def test_the_line_gives_the_options_back(command, chosen):
    line = command_line(command, "my file.npz", *chosen, out="here")
    given = options_of(line)
    for options in chosen:
        is_given = any(isinstance(one, type(options)) and vars(one) == vars(options) for one in given)
        assert is_given or options == type(options)()  # defaults are not written, nor bound


def test_defaults_and_resuming_are_left_out():
    assert command_line("parameterize", "bean", MapOptions(resume=True), out=None) == "iga-nn parameterize bean"
    assert command_line("solve poisson", "v.npz", device="cuda").endswith("v.npz --device cuda")
