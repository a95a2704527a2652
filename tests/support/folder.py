"""Fifty files as people have them in their folders, of four kinds that were refused once: open, several bodies, sheets
that touch, formats. Each is made by code, with the volume of the body that is meant."""

from __future__ import annotations

import gzip
from dataclasses import dataclass

import numpy as np
import trimesh
from mesh_files import CUBE, TRIANGLES, ball, binary_stl, joined, obj, off, ply
from scene_files import glb, gltf, threemf, zipped


@dataclass(frozen=True)
class Given:
    """One file: its name and content, the volume that is meant, and by which share it may differ."""

    name: str
    content: bytes
    volume: float
    share: float = 1e-9


def volume_of(vertices, faces):
    return float(trimesh.Trimesh(vertices, faces, process=False).volume)


def blob(subdivisions=3, stretch=(1.0, 0.8, 0.6), center=(0.0, 0.0, 0.0)):
    """A ball with waves."""
    vertices, faces = ball(subdivisions=subdivisions)
    waves = 1.0 + 0.1 * np.sin(5.0 * vertices[:, :1]) * np.cos(4.0 * vertices[:, 1:2])
    return vertices * waves * np.array(stretch) + np.array(center), faces


def pierced(holes, width):
    """A blob without the faces around some places, `width` away at most."""
    vertices, faces = blob(4)
    places = vertices[np.random.default_rng(holes).choice(len(vertices), holes, replace=False)]
    middles = vertices[faces].mean(axis=1)
    near = np.min(np.linalg.norm(middles[:, None] - places, axis=2), axis=1) < width
    return vertices, faces[~near], volume_of(vertices, faces)


def open_ones():
    for k, width in enumerate((0.05, 0.07, 0.09, 0.11, 0.13, 0.16, 0.2, 0.25, 0.3, 0.4, 0.5)):
        vertices, faces, volume = pierced(1, width)
        yield Given(f"hole{k}.obj", obj(vertices, faces).encode(), volume, 0.02)
    yield Given("box.obj", obj(faces=TRIANGLES[2:]).encode(), 1.0)
    for holes in (2, 3, 5, 8, 13, 21, 38):
        vertices, faces, volume = pierced(holes, 0.06)
        yield Given(f"holes{holes}.ply", ply(vertices, faces, binary=True), volume, 0.02)


def several():
    main = blob()
    volume = volume_of(*main)
    inside = blob(2, (0.2, 0.2, 0.2))
    inner = inside[0], inside[1][:, ::-1]
    for name, parts in {
        "speck": (main, blob(1, (0.1, 0.1, 0.1), (2, 0, 0))),
        "finer_speck": (main, blob(4, (0.1, 0.1, 0.1), (2, 0, 0))),
        "twins": (main, blob(center=(3, 0, 0), stretch=(0.9, 0.8, 0.6))),
        "overlap": (main, blob(center=(0.9, 0, 0), stretch=(0.5, 0.5, 0.5))),
        "cavity": (main, inner),
        "core": (main, inside),
        "cavity_and_speck": (main, inner, blob(1, (0.1, 0.1, 0.1), (2, 0, 0))),
        "copy": (main, main),
        "dust": (main, *(blob(1, (0.02, 0.02, 0.02), (2, 0.1 * i, 0)) for i in range(30))),
        "open_speck": (main, (CUBE + 2.0, TRIANGLES[3:])),
        "sheet_beside": (main, (CUBE[:4] + 2.0, np.array([[0, 1, 2], [1, 3, 2]]))),
        "inward_speck": (main, (CUBE / 4 + 2.0, TRIANGLES[:, ::-1])),
        "open_main": ((main[0], main[1][1:]), blob(1, (0.1, 0.1, 0.1), (2, 0, 0))),
    }.items():
        yield Given(f"{name}.obj", obj(*joined(*parts)).encode(), volume, 1e-4)


def sheets():
    vertices, faces = blob()
    volume = volume_of(vertices, faces)
    yield Given("doubled.obj", obj(vertices, np.concatenate([faces, faces[200:260]])).encode(), volume)
    yield Given("both_sides.off", off(vertices, np.concatenate([faces, faces[:, ::-1]])).encode(), volume)
    rooms, numbers = np.unique(np.concatenate([CUBE, CUBE + [0, 0, 1]]), axis=0, return_inverse=True)
    walls = numbers.ravel()[np.concatenate([TRIANGLES, TRIANGLES + 8])]
    yield Given("rooms.stl", binary_stl(rooms, walls), 2.0)
    fin = np.concatenate([faces, [[faces[0, 0], faces[0, 1], len(vertices)]]])
    yield Given("fin.obj", obj(np.vstack([vertices, [[2, 2, 2]]]), fin).encode(), volume)


def formats():
    vertices, faces = blob()
    volume = volume_of(vertices, faces)
    scene = trimesh.Scene(trimesh.Trimesh(vertices, faces, process=False))
    small = 1e-6  # single precision of the format
    yield Given("scene.glb", scene.export(file_type="glb"), volume, small)
    for k, node in enumerate(
        (
            {"mesh": 0},
            {"mesh": 0, "scale": [-1, 1, 1]},
            {"mesh": 0, "translation": [1e3, 0, 0]},
            {"mesh": 0, "rotation": [0.5, 0.5, 0.5, 0.5]},
            {"mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1]},
        )
    ):
        yield Given(f"node{k}.glb", glb(gltf(vertices, faces, nodes=[node])), volume, small)
    yield Given("inside.gltf", gltf(vertices, faces, inside=False)[0], volume, small)
    soup = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    yield Given("soup.glb", glb(gltf(*soup)), volume, small)
    yield Given("obj.zip", zipped({"model.obj": obj(vertices, faces)}), volume)
    yield Given(
        "stl.zip", zipped({"deep/down/model.STL": binary_stl(vertices, faces), "notes.txt": "x"}), volume, small
    )
    yield Given("ply.zip", zipped({"__MACOSX/._m.ply": "x", "m.ply": ply(vertices, faces)}), volume, small)
    yield Given("off.zip", zipped({"m.off": off(vertices, faces)}), volume)
    yield Given("packed.ply.gz", gzip.compress(ply(vertices, faces, binary=True)), volume, small)
    yield Given("model.3mf", threemf(), 8.0)


KINDS = {"open": open_ones, "several": several, "sheets": sheets, "formats": formats}
