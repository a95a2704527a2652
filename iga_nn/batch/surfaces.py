"""Turns a user's names (files, folders, patterns, samples, models, g1) into surfaces with a folder each."""

import glob
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from parameterize.surface.readers.file import FORMATS
from parameterize.surface.surface import MeshError, bodies_in

from ..errors import InputError
from ..models import MODELS, SET, in_set, not_found
from ..samples import SAMPLES
from ..workflow.output_folder import default_folder

NOTHING = "no surface is named: give files, folders, patterns in quotes, samples or models"


@dataclass(frozen=True)
class Entry:
    """Hold one surface of a batch.

    name: the user's name for it. mesh: its absolute path, or the name of a sample or a model. folder: the folder of its
    results.
    """

    name: str
    mesh: str
    folder: Path


def entries_of(surfaces: Sequence[str], out: Path) -> list[Entry]:
    """Return the named surfaces, each once, in the order of the names, with different folders in `out`.

    Files are given by their absolute paths, so that a worker with another current folder finds them. Raises InputError
    where nothing is named, and where a folder or a pattern contains no surface.
    """
    found: dict[str, str] = {}  # key of a surface -> name
    for given in surfaces:
        for name in _names_in(given):
            found.setdefault(str(Path(name).resolve()) if Path(name).is_file() else name, name)
    if not found:
        raise InputError(NOTHING)
    meshes = [str(Path(name).absolute()) if Path(name).is_file() else name for name in found.values()]
    return [
        Entry(printable(name), mesh, out.absolute() / folder)
        for name, mesh, folder in zip(found.values(), meshes, distinct_folders(meshes), strict=True)
    ]


def divided(entries: Sequence[Entry], max_faces: int) -> list[tuple[Entry, int | None]]:
    """Return an entry, NAME-0, NAME-1 and so on, and the number of its component for each body of the entries' files.

    A file of one component stays as it is, and so does one that is refused: the run says why.
    """
    found: list[tuple[Entry, int | None]] = []
    for entry in entries:
        try:
            numbers = bodies_in(Path(entry.mesh), max_faces) if Path(entry.mesh).is_file() else [None]
        except MeshError:
            numbers = [None]
        for number in numbers:
            ending = "" if number is None else f"-{number}"
            folder = entry.folder.with_name(entry.folder.name + ending)
            found.append((replace(entry, name=entry.name + ending, folder=folder), number))
    folders = _numbered([entry.folder.name for entry, _ in found])
    return [
        (replace(entry, folder=entry.folder.with_name(folder)), number)
        for (entry, number), folder in zip(found, folders, strict=True)
    ]


def demand_surfaces(surfaces: Sequence[str], problems: Sequence[str]) -> None:
    """Raise InputError if no surface is named, and if the first one is no surface, but like the name of a problem."""
    if not surfaces:
        raise InputError(NOTHING)
    first = surfaces[0]
    if first in SAMPLES or first in MODELS or Path(first).exists():
        return
    if near := get_close_matches(first, problems, 1):
        raise InputError(f"{first}: no such problem and no such surface; did you mean {near[0]}?")


def demand_one(entries: Sequence[Entry]) -> None:
    """Raise MeshError where no named surface exists; where some exist, the table shows the others as refused."""
    if not any(entry.mesh in SAMPLES or entry.mesh in MODELS or Path(entry.mesh).exists() for entry in entries):
        raise not_found(entries[0].name)


def _names_in(given: str) -> Iterator[str]:
    """Yield the files or names that one argument means. Raises InputError where there are none."""
    path = Path(given)
    if path.is_file() or given in SAMPLES or given in MODELS or not given:
        yield given
    elif given == SET:
        yield from in_set()
    elif path.is_dir():
        files = sorted(file for file in path.iterdir() if file.is_file() and _is_surface(file))
        if not files:
            raise InputError(f"{given}: this folder holds no surface; their names end in {' '.join(FORMATS)}")
        yield from map(str, files)
    elif glob.has_magic(given):
        matches = glob.glob(given, recursive=True)  # noqa: PTH207 - a Path takes no absolute pattern
        files = sorted(file for file in map(Path, matches) if file.is_file())
        if not files:
            raise InputError(f"{given}: no file matches this pattern")
        yield from map(str, files)
    else:
        yield given  # the run refuses it, and the other surfaces are computed


def _is_surface(file: Path) -> bool:
    name = file.name.lower().removesuffix(".gz")
    return name.endswith(FORMATS) and not name.startswith(".")


def distinct_folders(meshes: Sequence[str]) -> list[str]:
    """Return a different folder name for each of the surfaces.

    The name is the surface's stem, as in `run`. Surfaces with the same stem take the name of their file instead, then
    that name after the name of the file's folder, and so on up the path; a number separates names that are still equal.
    """
    choices = [_folder_names(mesh) for mesh in meshes]
    level = [0] * len(meshes)
    while True:
        names = [choice[at] for choice, at in zip(choices, level, strict=True)]
        count = Counter(name.casefold() for name in names)  # some file systems do not tell A from a
        longer = [i for i, name in enumerate(names) if count[name.casefold()] > 1 and level[i] + 1 < len(choices[i])]
        if not longer:
            return _numbered(names)
        for i in longer:
            level[i] += 1


def _folder_names(mesh: str) -> list[str]:
    """Return names for a surface's folder, from the shortest to the longest, which contains the whole path."""
    path = Path(mesh)
    above = [part for part in path.parts[:-1] if part != path.anchor]
    return [str(default_folder(mesh)), *("_".join([*above[start:], path.name]) for start in range(len(above), -1, -1))]


def _numbered(names: Sequence[str]) -> list[str]:
    """Return the names, with a number after each name that has already occurred."""
    taken: dict[str, str] = {}
    for name in names:
        number, free = 1, name
        while free.casefold() in taken:
            number += 1
            free = f"{name}-{number}"
        taken[free.casefold()] = free
    return list(taken.values())


def printable(text: str) -> str:
    """Return the text in a form for every terminal and file, because file names may contain any bytes."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in text)
