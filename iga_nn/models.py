"""Surfaces by name: a path, a sample, or a published model, in the folder IGA_NN_DATA or in its public repository."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from parameterize.files import save_bytes
from parameterize.surface.surface import MAX_FACES, MeshError, Surface, load_surface

from .samples import SAMPLES, obj_text, sample

DATA_FOLDER = "IGA_NN_DATA"
RAW = "https://raw.githubusercontent.com"
TIMEOUT = 60.0  # seconds


@dataclass(frozen=True)
class Model:
    """A published model: where its file is, and the file's sha256. Of tetrahedra the boundary is taken."""

    path: str
    sha256: str

    @property
    def url(self) -> str:
        """Address of the raw file."""
        return f"{RAW}/{self.path}"


def _g1(name: str, sha256: str) -> tuple[str, Model]:
    return name, Model(f"VOLMAP/dataset/HEAD/G1/{name}.mesh", sha256)


MODELS = {
    "conch": Model(
        "ZZ-SEC/Volumetric-Domain-Parameterization/HEAD/mesh/conch.obj",
        "e3011343902ea74ff4678631b0cfc6218561584a6700d34f82a720559e854217",
    ),
    **dict(
        [
            _g1("bimba", "4e0fab628220c4fc945a5ba7eb3c5a2049f9d853b8d3870bb046d0dd5e9af5ea"),
            _g1("bird", "90062dbc703681f720fe0cc7b07b757458beb3cb303979b4b995207424dbd664"),
            _g1("bone", "946bc6d8a408fe25dbce4be731f6884e1394dade6275914c4f2d03eba43ea62d"),
            _g1("bumpy_sphere", "919a184132ae4399adb0313cc606c29284b3c0bedcef1bb0d49ddf2d02be068e"),
            _g1("bunny", "24686cfe58186b65adbe1df6b12d47e241f5660146b35c790970824058301b55"),
            _g1("duck", "56c1ef649350761b5eaf5f684f3e8872b29b4d80cf66c509e62a2d524333e73e"),
            _g1("hand", "f788b19297338e9b6ad267aa33c6722cdbcc6b56518808d25dc18c1fcc1fe118"),
            _g1("homer", "f6d7fbf523957c9ed2641131690acd825264151a27cd00856ac8fa73eff582f8"),
            _g1("moai", "39c073611de81f65a6fc8c9acbc6d8f346c03c5aabd9360c07a6d14d4f20ab88"),
            _g1("octa_flower", "20ac624ee8b40b5661d678a4919a9890f41fb44756067ee5ef6e01f9f9ceb5d1"),
            _g1("pig", "2785ee8dee77fe37683ea896db5e0d7f8da2a0f9d51976fb8fe577addad6e0ae"),
            _g1("blade", "3c9d99cfd9cf9ec23ba33c1f4c591a5a558c9065552d1486dd8924ad5552f63e"),
            _g1("buste", "49b7a534215e45fd5e7bbd78fbed798f802d3aa6624648819b808574bb324e65"),
            _g1("camile_hand", "e57ffc0f315412f2c4eeb03049d541e9bc2d0fe9a455892c478c0118835aaf15"),
            _g1("devil", "3ffe8bdb5458fa14f2f58bb1958a95acd3dd39ca376d12e2e0e5f66c757f1f5d"),
            _g1("foot", "a1c817d93e37f156264afe1e71495fb224246eb6a0c52bbd1894e50da67f67ed"),
            _g1("gargoyle", "00873fceadf60d9d838842c28182a11cc3f94ed53ee6256c6b86a3b6953c896b"),
            _g1("mouse", "5e543275f64910f75d2cc26ddb7301fc3671b0d65f9d246418115696f5f672de"),
            _g1("ramses", "bfba4fafa8b0563daa6a911090209c9e3a95089221c2ad4c3f211dbd8dd8fb0c"),
            _g1("sphinx", "e50f873f0e0656f90a5a72bec4264e5de2481e54e44f41c8339bea67f64e2a78"),
        ]
    ),
}


def resolve(name: str, *, component: int | None = None, max_faces: int = MAX_FACES, decimate: bool = False) -> Surface:
    """Read the surface meant by MESH: a file, else a sample, else a model in the folder IGA_NN_DATA.

    component, max_faces: as in load_surface. decimate: bring a larger surface down to max_faces instead of refusing it.
    Raises MeshError saying where to get what is missing.
    """
    if decimate:
        from parameterize.surface import decimation

        larger = resolve(name, component=component, max_faces=max(max_faces, MAX_FACES))
        return decimation.decimate(larger, max_faces)
    if not name:
        raise MeshError("no surface is named: give a file, or one of the samples " + ", ".join(SAMPLES))
    is_file = Path(name).is_file()  # the results' folder has the sample's name, too
    if not is_file and name in SAMPLES:
        surface = sample(name)
        if component not in (None, 0):
            raise MeshError(f"{name}: no component {component}: a sample is one piece; leave --component out")
        if len(surface.faces) > max_faces:
            raise MeshError(
                f"{name}: {len(surface.faces)} faces, more than {max_faces}: raise --max-faces, or add --decimate"
            )
        return surface
    found = None if is_file else _in_data_folder(name)
    known = Path(name).name.split(".")[0]
    if not is_file and found is None and known in MODELS:  # a folder of that name holds its results
        raise MeshError(f"{name}: not found; get it with `iga-nn fetch {known}`, or set {DATA_FOLDER} to its folder")
    if found is not None or Path(name).exists():
        return load_surface(found or name, component=component, max_faces=max_faces)
    if Path(name).suffix:
        raise MeshError(f"{name}: no such file: check the name and the folder")
    raise MeshError(f"{name}: no such file and no sample; the samples are {', '.join(SAMPLES)}")


def fetch_all(name: str, out: str | Path | None = None, *, force: bool = False) -> Iterator[Path]:
    """Write the model of that name, or, for "g1", one after the other those of the set G1; yield the paths.

    Raises as `fetch` does, and where `out` is given for the whole set.
    """
    if name != "g1":
        yield fetch(name, out, force=force)
        return
    if out is not None:
        raise MeshError("g1: is a set of models, each written to NAME.obj: leave --out out")
    for model in sorted(name for name in MODELS if "/G1/" in MODELS[name].path):
        yield fetch(model, force=force)


def fetch(name: str, out: str | Path | None = None, *, force: bool = False) -> Path:
    """Write the model of that name as OBJ (default: NAME.obj in the current folder) and return the path.

    From IGA_NN_DATA where it is there, else downloaded once, checked by its sha256 and kept in the user's cache.
    Raises MeshError for an unknown name, where the file is there with other content (unless `force`), and, without a
    network, saying where to put the file.
    """
    if name not in MODELS:
        raise MeshError(f"{name}: no such model; the models are {', '.join(sorted(MODELS))}; g1 is all but conch")
    target = obj_path(name, out)
    source = _in_data_folder(name) or _download(name)
    is_obj = source.suffix == ".obj"
    save_new(target, source.read_bytes() if is_obj else obj_text(load_surface(source)).encode(), force)
    return target


def save_new(target: Path, content: bytes, force: bool) -> None:
    """Write a file that is not there yet, or has that content; any other one only where `force`. Raises MeshError."""
    try:
        if not target.exists() or force:
            save_bytes(target, content)
        elif target.read_bytes() != content:
            raise MeshError(f"{target}: exists; --force replaces it, --out names another file")
    except OSError as error:
        raise MeshError(f"{target}: cannot be written ({error.strerror}): choose another with --out") from None


def obj_path(name: str, out: str | Path | None) -> Path:
    """The OBJ file to write. Raises MeshError where it cannot be one."""
    target = Path(out) if out is not None else Path(f"{name}.obj")
    if target.is_dir() or not target.name:
        raise MeshError(f"{target}: is a directory: name the file to write")
    if target.suffix != ".obj":
        raise MeshError(f"{target}: surfaces are written as .obj: choose such a name with --out")
    if not target.parent.is_dir():
        raise MeshError(
            f"{target}: cannot be written (there is no folder {target.parent}): make it, or choose another with --out"
        )
    return target


def _in_data_folder(name: str) -> Path | None:
    """The model `name` or `name.obj` in IGA_NN_DATA, as an OBJ or as the published tetrahedra."""
    folder = os.environ.get(DATA_FOLDER)
    known = name.removesuffix(".obj")
    if not folder or known not in MODELS:
        return None
    candidates = [Path(folder, known + suffix) for suffix in (".obj", ".mesh")]
    return next((path for path in candidates if path.is_file()), None)


def _download(name: str) -> Path:
    import pooch

    model = MODELS[name]
    pooch.get_logger().setLevel("WARNING")
    try:
        path = pooch.retrieve(
            model.url,
            known_hash=f"sha256:{model.sha256}",
            path=pooch.os_cache("iga-nn"),
            fname=Path(model.path).name,
            downloader=pooch.HTTPDownloader(timeout=TIMEOUT),
        )
    except (OSError, ValueError) as error:  # no network, or not the file with this checksum
        reason = "no connection" if "Connect" in type(error).__name__ else str(error).splitlines()[0][:120]
        raise MeshError(
            f"{name}: cannot be downloaded from {model.url} ({reason}): "
            f"put {Path(model.path).name} into a folder and set {DATA_FOLDER} to that folder"
        ) from None
    return Path(path)
