"""Finds surfaces by name: a path, a sample, or a published model in the folder IGA_NN_DATA or in its repository."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from parameterize.surface.bodies import Choice
from parameterize.surface.features import SHARP
from parameterize.surface.holes import Close
from parameterize.surface.surface import MAX_FACES, MeshError, Surface, load_surface, surface_from_arrays

from .errors import InputError, did_you_mean
from .new_file import check_new, save_new
from .samples import SAMPLES, obj_text

MOST_READ = 2_000_000  # faces: reading them takes some 2 GB of memory
DATA_FOLDER = "IGA_NN_DATA"
SET = "g1"  # names a set of models
RAW = "https://raw.githubusercontent.com"
TIMEOUT = 60.0  # seconds


@dataclass(frozen=True)
class Model:
    """Hold a published model. path: of its file in the public repository; the boundary of tetrahedra is taken."""

    path: str
    sha256: str


_ROWS = (files(__package__) / "models.txt").read_text(encoding="utf-8").splitlines()
_PUBLISHED = [Model(*row.split()) for row in _ROWS if not row.startswith("#")]
MODELS = {Path(model.path).stem: model for model in _PUBLISHED}


def resolve(
    name: str,
    *,
    component: Choice = None,
    close: Close = False,
    deflection: float | None = None,
    max_faces: int = MAX_FACES,
    decimate: bool = False,
    sharp: float = SHARP,
) -> Surface:
    """Return the surface that MESH names: a file, else a sample, else a model in the folder IGA_NN_DATA.

    component, close, deflection, max_faces: as in load_surface. decimate: reduce a larger surface, of at most MOST_READ
    faces, to max_faces instead of refusing it; where max_faces is MAX_FACES, as by default, that is done anyway, with a
    notice. sharp: the angle in degrees above which an edge counts as sharp. Raises MeshError with the way to get a
    missing file, and InputError for an angle that is not between 0 and 180.
    """
    if not 0.0 < sharp < 180.0:
        raise InputError(f"sharp {sharp:g}: must be an angle between 0 and 180 degrees")
    how: dict[str, Any] = {"component": component, "close": close, "deflection": deflection}
    if decimate or max_faces == MAX_FACES:
        from parameterize.surface import decimation

        larger = _found(name, {**how, "max_faces": max(max_faces, MOST_READ)})
        return replace(decimation.decimate(larger, max_faces), sharp=sharp)
    return replace(_found(name, {**how, "max_faces": max_faces}), sharp=sharp)


def _found(name: str, asked: dict[str, Any]) -> Surface:
    """Return the surface of that name. asked: the keywords of load_surface."""
    if not name:
        raise MeshError("no surface is named: give a file, or one of the samples " + ", ".join(SAMPLES))
    if Path(name).is_file():
        return load_surface(name, **asked)
    if name in SAMPLES:  # before folders: the results of a sample are in a folder of its name
        if asked.pop("deflection") is not None:
            raise MeshError(f"{name}: deflection is for files of solid models: leave --deflection out")
        return surface_from_arrays(*SAMPLES[name](), name, **asked)
    if found := _in_data_folder(name):
        return load_surface(found, **asked)
    if Path(name).exists() and Path(name).name.split(".")[0] not in MODELS:
        return load_surface(name, **asked)
    raise not_found(name)


def not_found(name: str) -> MeshError:
    """Return the refusal of a name that is no file, no sample and no model at hand, with a remedy and similar names."""
    stem = Path(name).name.split(".")[0]
    if stem in MODELS:
        return MeshError(f"{name}: not found; get it with `iga-nn fetch {stem}`, or set {DATA_FOLDER} to its folder")
    if name == f"{stem}.obj" and stem in SAMPLES:
        return MeshError(f"{name}: no such file; `iga-nn sample {stem}` writes it")
    hint = did_you_mean(name, (*SAMPLES, *MODELS))
    if Path(name).suffix:
        return MeshError(f"{name}: no such file: check the name and the folder{hint}")
    return MeshError(f"{name}: no such file and no sample; the samples are {', '.join(SAMPLES)}{hint}")


def fetch_all(name: str, out: str | Path | None = None, *, force: bool = False) -> Iterator[Path]:
    """Write the model of that name, or, for "g1", those of the set G1; yield the paths. Raises as `fetch` does."""
    if name == SET and out is not None:
        raise InputError(f"{SET}: is a set of models, each written to NAME.obj: leave --out out")
    for model in in_set() if name == SET else [name]:
        yield fetch(model, out, force=force)


def in_set() -> list[str]:
    """Return the names of the models of the set G1, in alphabetical order."""
    return sorted(name for name in MODELS if "/G1/" in MODELS[name].path)


def fetch(name: str, out: str | Path | None = None, *, force: bool = False) -> Path:
    """Write the model of that name as OBJ (default: NAME.obj in the current folder) and return the path.

    The model is taken from IGA_NN_DATA where it is there; else it is downloaded once, checked by its sha256 and kept in
    the user's cache. Raises InputError for an unknown name, where the file exists with other content (unless `force`),
    and without a network, saying where to put the file; MeshError where the model cannot be read.
    """
    if name not in MODELS:
        known = f"the models are {', '.join(sorted(MODELS))}; g1 is all but conch"
        raise InputError(f"{name}: no such model; {known}{did_you_mean(name, MODELS)}")
    target = check_new(f"{name}.obj" if out is None else out, ".obj")
    source = _in_data_folder(name) or _download(name)
    is_obj = source.suffix == ".obj"
    save_new(target, source.read_bytes() if is_obj else obj_text(load_surface(source)).encode(), force)
    return target


def _in_data_folder(name: str) -> Path | None:
    """Return the file of the model `name` or `name.obj` in IGA_NN_DATA, an OBJ or the published tetrahedra."""
    folder = os.environ.get(DATA_FOLDER)
    known = name.removesuffix(".obj")
    if not folder or known not in MODELS:
        return None
    candidates = [Path(folder, known + suffix) for suffix in (".obj", ".mesh")]
    return next((path for path in candidates if path.is_file()), None)


def _download(name: str) -> Path:
    """Return the path of the published file in the user's cache. Raises InputError where it cannot be downloaded."""
    import pooch

    model = MODELS[name]
    url, file = f"{RAW}/{model.path}", Path(model.path).name
    pooch.get_logger().setLevel("WARNING")
    try:
        path = pooch.retrieve(
            url,
            known_hash=f"sha256:{model.sha256}",
            path=pooch.os_cache("iga-nn"),
            fname=file,
            downloader=pooch.HTTPDownloader(timeout=TIMEOUT),
        )
    except (OSError, ValueError) as error:  # no network, or not the file with this checksum
        reason = "no connection" if "Connect" in type(error).__name__ else str(error).splitlines()[0][:120]
        raise InputError(
            f"{name}: cannot be downloaded from {url} ({reason}): "
            f"put {file} into a folder and set {DATA_FOLDER} to that folder"
        ) from None
    return Path(path)
