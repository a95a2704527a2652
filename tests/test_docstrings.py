"""What the docstrings of the packages show is run."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest


@pytest.mark.parametrize("name", ["parameterize", "solve", "iga_nn.io.formats"])
def test_examples_run(name, in_folder):
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    runner.run(parser.get_doctest(import_module(name).__doc__, {}, name, name, 0))
    assert runner.tries >= 4 and runner.failures == 0
