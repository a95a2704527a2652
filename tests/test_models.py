import hashlib
import os
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

import meshio
import numpy as np
import pooch
import pytest

from iga_nn import models as data
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.models import MODELS, Model, fetch, fetch_all, resolve
from iga_nn.samples import sample, write_obj
from parameterize.surface.surface import MeshError

REAL_MODELS = Path(os.environ.get("IGA_NN_DATA", Path(__file__).parents[2] / "shared" / "models"))


@pytest.fixture(autouse=True)
def an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("IGA_NN_DATA", raising=False)
    return tmp_path


@pytest.fixture
def data_folder(tmp_path, monkeypatch):
    folder = tmp_path / "data"
    folder.mkdir()
    monkeypatch.setenv("IGA_NN_DATA", str(folder))
    return folder


def test_a_path_comes_before_a_sample(an_empty_folder):
    assert resolve("cube").volume == pytest.approx(1.0)
    write_obj(sample("ellipsoid"), an_empty_folder / "cube.obj")
    assert resolve("cube.obj").volume == pytest.approx(sample("ellipsoid").volume)


def test_a_results_folder_of_the_samples_name_is_no_surface(an_empty_folder):
    (an_empty_folder / "cube").mkdir()
    assert resolve("cube").name == "cube"


def test_options_reach_the_gate(an_empty_folder):
    write_obj(sample("cube"), an_empty_folder / "block.obj")
    with pytest.raises(MeshError, match="more than max_faces=10"):
        resolve("block.obj", max_faces=10)
    with pytest.raises(MeshError, match="component 3 does not exist"):
        resolve("block.obj", component=3)


def test_models_are_found_in_the_data_folder(data_folder):
    write_obj(sample("cube"), data_folder / "conch.obj")
    for name in ("conch", "conch.obj"):
        surface = resolve(name)
        assert (surface.name, len(surface.vertices)) == ("conch", 1538)


def test_missing_models_say_where_to_get_them():
    for name in ("conch", "conch.obj", "models/bunny.obj"):
        known = Path(name).stem
        with pytest.raises(
            MeshError, match=f"{name}: not found; get it with `iga-nn fetch {known}`, or set IGA_NN_DATA"
        ):
            resolve(name)


def test_a_results_folder_of_a_models_name_is_no_surface(an_empty_folder):
    (an_empty_folder / "conch").mkdir()
    with pytest.raises(MeshError, match="conch: not found; get it with `iga-nn fetch conch`"):
        resolve("conch")


def test_the_set_g1_is_fetched_model_by_model(data_folder):
    for name in MODELS:
        write_obj(sample("cube"), data_folder / f"{name}.obj")
    paths = [str(path) for path in fetch_all("g1")]
    assert paths == sorted(f"{name}.obj" for name in MODELS if name != "conch")
    assert all(Path(path).is_file() for path in paths) and not Path("conch.obj").exists()
    with pytest.raises(InputError, match="leave --out out"):
        list(fetch_all("g1", "all.obj"))


def test_other_names_are_told_what_is_wrong():
    with pytest.raises(MeshError, match=r"santa4\.obj: no such file"):
        resolve("santa4.obj")
    with pytest.raises(MeshError, match="teapot: no such file and no sample; the samples are bean, "):
        resolve("teapot")


def test_fetch_copies_from_the_data_folder(data_folder):
    write_obj(sample("cube"), data_folder / "conch.obj")
    path = fetch("conch")
    assert path == Path("conch.obj")
    assert path.read_bytes() == (data_folder / "conch.obj").read_bytes()
    assert fetch("conch", data_folder / "conch.obj").is_file()  # onto itself
    path.write_text("mine\n")
    with pytest.raises(InputError, match=r"conch\.obj: exists; --force"):
        fetch("conch")
    assert fetch("conch", force=True).read_bytes() == (data_folder / "conch.obj").read_bytes()


def test_fetch_takes_the_boundary_of_tetrahedra(data_folder):
    points = np.vstack([np.zeros(3), np.eye(3)])
    meshio.write(data_folder / "duck.mesh", meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))]))
    surface = resolve(str(fetch("duck", "small.obj")))
    assert surface.faces.shape == (4, 3)
    assert surface.volume == pytest.approx(1.0 / 6.0)


def test_fetch_downloads_the_published_file_by_its_checksum(an_empty_folder, monkeypatch):
    asked = {}

    def retrieve(url, known_hash, path, fname, downloader):
        asked.update(url=url, known_hash=known_hash)
        write_obj(sample("cube"), an_empty_folder / fname)
        return str(an_empty_folder / fname)

    monkeypatch.setattr(pooch, "retrieve", retrieve)
    assert fetch("conch", "here.obj").is_file()
    assert asked["url"].endswith("/ZZ-SEC/Volumetric-Domain-Parameterization/HEAD/mesh/conch.obj")
    assert asked["known_hash"] == "sha256:e3011343902ea74ff4678631b0cfc6218561584a6700d34f82a720559e854217"


def test_fetch_without_a_network_says_where_to_put_the_file(monkeypatch):
    def retrieve(*_, **__):
        raise ConnectionError("no route to host\nmore")

    monkeypatch.setattr(pooch, "retrieve", retrieve)
    with pytest.raises(
        InputError,
        match=r"bunny: cannot be downloaded from https://\S+/G1/bunny.mesh \(no connection\): put bunny.mesh into",
    ):
        fetch("bunny")
    assert not Path("bunny.obj").exists()


class PublishedFiles(BaseHTTPRequestHandler):
    """A repository's files on this machine; it remembers what was asked for."""

    content: ClassVar[dict[str, bytes]] = {}
    asked: ClassVar[list[str]] = []

    def do_GET(self):
        self.asked.append(self.path)
        content = self.content.get(self.path)
        self.send_response(404 if content is None else 200)
        self.end_headers()
        self.wfile.write(content or b"")

    def log_message(self, *_):
        pass


@pytest.fixture
def repository(an_empty_folder, monkeypatch):
    """Downloads go to a server on this machine, which has nothing at first; the cache is empty."""
    PublishedFiles.content, PublishedFiles.asked = {}, []
    server = ThreadingHTTPServer(("127.0.0.1", 0), PublishedFiles)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setattr(data, "RAW", f"http://127.0.0.1:{server.server_port}")
    monkeypatch.setattr(pooch, "os_cache", lambda name: an_empty_folder / "cache")
    yield PublishedFiles
    server.shutdown()
    server.server_close()


def test_fetch_downloads_once_and_then_needs_no_network(repository, an_empty_folder, monkeypatch):
    write_obj(sample("cube"), an_empty_folder / "published.obj")
    content = (an_empty_folder / "published.obj").read_bytes()
    model = Model("some/repository/HEAD/conch.obj", hashlib.sha256(content).hexdigest())
    monkeypatch.setitem(MODELS, "conch", model)
    with pytest.raises(InputError, match=r"conch: cannot be downloaded from http://127\.0\.0\.1:\d+/\S+ \(404"):
        fetch("conch")
    repository.content["/" + model.path] = content
    assert main(["fetch", "conch"]) == 0
    assert Path("conch.obj").read_bytes() == content
    assert repository.asked == ["/" + model.path] * 2
    Path("conch.obj").unlink()
    assert main(["fetch", "conch"]) == 0 and Path("conch.obj").read_bytes() == content
    assert len(repository.asked) == 2  # the second time from the cache


def test_a_download_with_another_checksum_is_refused(an_empty_folder, monkeypatch):
    """Through pooch itself, with a server replaced by a local writer."""

    def serve(self, url, output_file, pooch, **_):
        Path(output_file).write_text("v 0 0 0\n")

    monkeypatch.setattr(pooch.HTTPDownloader, "__call__", serve)
    monkeypatch.setattr(pooch, "os_cache", lambda name: an_empty_folder / "cache")
    with pytest.raises(InputError, match="cannot be downloaded .* hash"):
        fetch("conch")


def test_fetch_refuses_unknown_models_and_bad_targets(an_empty_folder, data_folder):
    write_obj(sample("cube"), data_folder / "conch.obj")
    with pytest.raises(InputError, match="santa4: no such model; the models are bimba, "):
        fetch("santa4")
    with pytest.raises(InputError, match="is a directory: name the file to write"):
        fetch("conch", an_empty_folder)
    with pytest.raises(InputError, match="cannot be written .* --out"):
        fetch("conch", an_empty_folder / "absent" / "conch.obj")


def test_every_model_has_a_checksum_and_a_public_address():
    assert len(MODELS) == 21
    for name, model in MODELS.items():
        assert model.path.count("/") >= 3 and Path(model.path).stem == name  # owner, repository, commit, file
        assert len(bytes.fromhex(model.sha256)) == 32
    assert data.RAW == "https://raw.githubusercontent.com" and data.DATA_FOLDER == "IGA_NN_DATA"


@pytest.mark.slow
def test_the_conch_at_hand_is_the_published_one():
    path = REAL_MODELS / "conch.obj"
    if not path.is_file():
        pytest.skip("no conch.obj in the folder of models")
    assert hashlib.sha256(path.read_bytes()).hexdigest() == MODELS["conch"].sha256


def test_a_surface_above_the_default_limit_is_reduced_with_a_notice(monkeypatch, an_empty_folder):
    monkeypatch.setattr("iga_nn.models.MAX_FACES", 2000)
    surface = resolve("bean", max_faces=2000)
    assert len(surface.faces) <= 2000 and surface.notices[0].startswith("decimated from 4996 to 2000 faces: moved by")
    with pytest.raises(MeshError, match="4996 faces, more than max_faces=1000"):
        resolve("bean", max_faces=1000)


def test_the_angle_of_sharp_edges_is_the_users():
    assert len(resolve("cube").features) == 12
    blunt = resolve("cube", sharp=95.0)
    assert blunt.sharp == 95.0 and len(blunt.features) == 0
    assert blunt.summary()["sharp_edges"]["edges"] == 0
    for angle in (0.0, 180.0):
        with pytest.raises(InputError, match="must be an angle between 0 and 180 degrees"):
            resolve("cube", sharp=angle)
