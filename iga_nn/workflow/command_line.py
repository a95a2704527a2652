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


def gives_the_same(one: str, other: str) -> bool:
    """Return whether two such lines give the same result.

    The lines may differ in the output folder, and in the names of the same file.
    """
    return _without_folder(one) == _without_folder(other)


def _without_folder(line: str) -> list[str]:
    words = shlex.split(line)
    if "--out" in words:
        at = words.index("--out")
        del words[at : at + 2]
    return [_as_path(word) for word in words]


def _as_path(word: str) -> str:
    """Return the absolute path of a word that names an existing file or folder, otherwise the word itself."""
    try:
        return str(Path(word).resolve(strict=True))
    except (OSError, RuntimeError, ValueError):  # most words are options and formulas
        return word


def _words(name: str, value: Any) -> list[str]:
    flag = "--" + name.replace("_", "-")
    if value is True:
        return [flag]
    if isinstance(value, tuple):
        return [flag, *map(str, value)]
    return [f"{flag}={value}"] if str(value).startswith("-") else [flag, str(value)]
