"""What the docstrings show is run: those of the packages, and of every name that the API documents."""

from __future__ import annotations

import doctest
import inspect
from functools import reduce
from importlib import import_module

import pytest
from documents import documented_names

import iga_nn


@pytest.mark.parametrize("name", ["parameterize", "solve"])
def test_examples_run(name, in_folder):
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    runner.run(parser.get_doctest(import_module(name).__doc__, {}, name, name, 0))
    assert runner.tries >= 4 and runner.failures == 0


def named(name):
    """The object of a name with its package, such as iga_nn.solve."""
    package, *rest = name.split(".")
    return reduce(getattr, rest, import_module(package))


def test_every_public_name_is_documented():
    assert {f"iga_nn.{name}" for name in iga_nn.__all__ if not name.startswith("_")} <= set(documented_names())


@pytest.mark.parametrize("name", sorted(documented_names()))
def test_examples_of_a_public_name_run(name, in_folder, short_training):
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    runner.run(parser.get_doctest(inspect.getdoc(named(name)), {}, name, name, 0))
    assert runner.tries >= 2 and runner.failures == 0


@pytest.mark.parametrize("name", [name for name in sorted(documented_names()) if inspect.isfunction(named(name))])
def test_every_argument_of_a_public_function_is_explained(name):
    explained = inspect.getdoc(named(name)).partition("Parameters\n---")[2]
    for argument in inspect.signature(named(name)).parameters:
        assert argument in explained, argument
