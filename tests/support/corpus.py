"""Files as people have them, made by code: the exit code of `iga-nn check` for each, and words of its answer."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass

import numpy as np
import trimesh
from mesh_files import CUBE, QUADS, TRIANGLES, ball, binary_stl, joined, obj, ply
from shapes import ball as round_surface
from surface_files import ACCEPTED, REFUSED


@dataclass(frozen=True)
class Case:
    """content: of the file. code: 0 accepted, 2 refused. says: words of a notice or of the error, "" where none.

    options: of `iga-nn check`.
    """

    content: bytes
    code: int
    says: str
    options: tuple[str, ...] = ()


def accepted(content, says="", *options):
    return Case(content if isinstance(content, bytes) else content.encode(), 0, says or "", options)


def refused(content, says, *options):
    return Case(content if isinstance(content, bytes) else content.encode(), 2, says, options)


def _torus():
    mesh = trimesh.creation.torus(1.0, 0.3, major_sections=24, minor_sections=12)
    return obj(mesh.vertices, mesh.faces)


def _spike():
    vertices, faces = ball(subdivisions=3)
    vertices[np.argmax(vertices[:, 2]), 2] -= 2.5
    return obj(vertices, faces)


def _scan(holes):
    vertices, faces = ball(subdivisions=3)
    return obj(vertices, np.delete(faces, np.arange(holes) * 97, axis=0))


def _room(places):
    """Cubes at these places, welded where they touch."""
    parts = [(CUBE + place, TRIANGLES) for place in places]
    vertices, faces = joined(*parts)
    corners, numbers = np.unique(vertices, axis=0, return_inverse=True)
    return obj(corners, numbers.ravel()[faces])


def _archive():
    """A surface zipped, under a name that would lead out of a folder."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("../../cube.obj", obj())
    return stream.getvalue()


def _textured():
    """Every corner of every face with a texture place of its own, as programs write models with seams."""
    places = "vt 0 0\nvt 1 0\nvt 0.5 1\n"
    rows = [f"f {a}/1 {b}/2 {c}/3" for a, b, c in (TRIANGLES + 1).tolist()]
    return obj(faces=[]) + places + "\n".join(rows) + "\n"


def _angle():
    """A prism over an L, turned in space and rounded: its ends are concave and not quite plane."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    vertices = np.vstack([np.c_[outline, np.full(6, z)] for z in (0, 1)])
    sides = [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    return obj(np.round(vertices @ turn.T, 4), [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides])


def _pocket():
    """A cube with a pocket in its top: that face has a hole, to which a slit leads from a corner."""
    square = CUBE[[0, 1, 3, 2]] / 2 + [0.25, 0.25, 0]
    walls = [[8 + i, 8 + (i + 1) % 4, 12 + (i + 1) % 4, 12 + i] for i in range(4)]
    faces = [QUADS[0], *QUADS[2:], [4, 5, 7, 6, 4, 8, 11, 10, 9, 8], [12, 13, 14, 15], *walls]
    return obj(np.vstack([CUBE, square + [0, 0, 1], square + [0, 0, 0.5]]), faces)


def _turned_inside(vertices, faces):
    return vertices, faces[:, ::-1]


def shapes():
    """Defects of the shape rather than of the file."""
    yield "torus.obj", accepted(_torus())
    yield "two_balls.obj", accepted(obj(*joined(ball(), ball(center=(3, 0, 0)))), "2 bodies are kept")
    yield "many_bodies.obj", accepted(obj(*joined(*(ball(0.4, (i, 0, 0), 1) for i in range(40)))), "40 bodies are kept")
    yield "shells.obj", accepted(obj(*joined(ball(2.0), _turned_inside(*ball()))), "1 cavity is kept, 12.50%")
    yield "flat.obj", refused(obj(CUBE * [1, 1, 0], TRIANGLES), "")
    yield "sheet.obj", refused(obj(CUBE[:4], [[0, 2, 3], [0, 3, 1], [0, 3, 2], [0, 1, 3]]), "")
    yield "scan.obj", refused(_scan(3), "open surface: 3 boundary loops (9 edges)")
    yield "closed_scan.obj", accepted(_scan(3), "closed 3 boundary loops", "--close")
    yield "lid.obj", refused(obj(faces=QUADS[1:]), "close the hole with --close all")
    yield "wide.obj", refused(obj(faces=QUADS[1:]), "the longest 231 % of the box's diagonal", "--close")
    yield "closed_lid.obj", accepted(obj(faces=QUADS[1:]), "area 1, 17 % of the surface", "--close", "all")
    yield "rooms.obj", accepted(_room([(0, 0, 0), (0, 0, 1)]), "walls of no thickness, area 1")
    yield "edge.obj", accepted(_room([(0, 0, 0), (0, 1, 1)]), "2 bodies are kept")
    yield "corner.obj", accepted(_room([(0, 0, 0), (1, 1, 1)]), "split 1 vertex", "--component", "largest")
    yield (
        "specks.obj",
        accepted(obj(*joined(ball(), ball(0.1, (3, 0, 0), 3))), "enclose 0.00", "--component", "largest"),
    )
    yield (
        "cavity.obj",
        accepted(obj(*joined(ball(2.0), _turned_inside(*ball()))), "12.50% of its volume", "--component", "largest"),
    )
    yield "crossed.obj", refused(obj(*joined(ball(), ball(center=(1, 0, 0)))), "components 0 and 1 cross each other")
    yield "angle.obj", accepted(_angle(), "8 polygons cut into 20 triangles")
    yield "pocket.obj", accepted(_pocket(), "11 polygons cut into 28 triangles")
    yield "spike.obj", accepted(_spike(), "self-intersection")
    yield "strict_spike.obj", refused(_spike(), "pull the sheets apart", "--strict")
    yield "huge.obj", accepted(obj(1e12 * CUBE), "unusual size")
    yield "tiny.obj", accepted(obj(1e-9 * CUBE), "unusual size")
    yield "far.obj", accepted(obj(CUBE + 1e7, QUADS), "far from the origin")


def files():
    """What is no defect of a surface: archives, limits, choices."""
    yield "cube.zip", accepted(_archive(), "unpacked '../../cube.obj' from .zip")
    yield "zipped.obj", refused(_archive(), "unpack what is in it first")
    yield "zipped.npz", refused(_archive(), "has no array named")
    yield "scene.gltf", refused('{"asset": {"version": "2.0"}}', "has no triangles")
    yield "archive.3mf", refused(_archive(), "the archive has no 3D model")
    yield "limit.obj", accepted(obj(faces=TRIANGLES), "", "--max-faces", "12")
    yield "over.obj", refused(obj(faces=TRIANGLES), "12 faces, more than max_faces=11", "--max-faces", "11")
    yield "over.stl", refused(binary_stl(), "12 faces, more than max_faces=11", "--max-faces", "11")
    yield "over.ply", refused(ply(), "12 faces, more than max_faces=11", "--max-faces", "11")
    yield "second.obj", accepted(obj(*joined(ball(), ball(center=(3, 0, 0)))), "component 1 taken", "--component", "1")
    yield "places.obj", accepted(_textured(), "")


def large():
    """50 000 vertices: too slow to make for every run of the tests."""
    return accepted(obj(*round_surface(50_000)), "")


CASES = {
    **{name: accepted(*row) for name, row in ACCEPTED.items()},
    **{name: refused(*row) for name, row in REFUSED.items()},
    **dict(shapes()),
    **dict(files()),
}
