"""Writes the command that repeats a result, from the options of the result."""

import shlex
from dataclasses import fields
from pathlib import Path
from typing import Any

SILENT = ("resume",)  # changes the way to a result, not the result


def command_line(command: str, source: str | Path, *chosen: Any, **given: Any) -> str:
    """Return one line for a shell: the command, its input, and every option that is not the default.

    chosen: frozen dataclasses of `iga_nn.options`. given: further options by name, left out where they are None.
    """
    words = ["iga-nn", *command.split(), str(source)]
    for group in chosen:
        for field in fields(group):
            value = getattr(group, field.name)
            if value != field.default and field.name not in SILENT:
                words += _words(field.name, value)
    for name, value in given.items():
        if value is not None:
            words += _words(name, value)
    return shlex.join(words)


def _words(name: str, value: Any) -> list[str]:
    flag = "--" + name.replace("_", "-")
    if value is True:
        return [flag]
    if isinstance(value, tuple):
        return [flag, *map(str, value)]
    return [f"{flag}={value}"] if str(value).startswith("-") else [flag, str(value)]
