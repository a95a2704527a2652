"""Files as people have them, made by code: the exit code of `iga-nn check` for each, and words of its answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from test_mesh import ACCEPTED, CUBE, QUADS, REFUSED, TRIANGLES, ball, joined, obj


@dataclass(frozen=True)
class Case:
    """content: of the file. code: 0 accepted, 2 refused. says: words of a notice or of the error, "" where none."""

    content: bytes
    code: int
    says: str


def accepted(content, says=""):
    return Case(content if isinstance(content, bytes) else content.encode(), 0, says or "")


def refused(content, says):
    return Case(content if isinstance(content, bytes) else content.encode(), 2, says)


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


def _turned_inside(vertices, faces):
    return vertices, faces[:, ::-1]


def shapes():
    """Defects of the shape rather than of the file."""
    yield "torus.obj", refused(_torus(), "genus 1")
    yield "two_balls.obj", refused(obj(*joined(ball(), ball(center=(3, 0, 0)))), "2 components")
    yield "overlapping_balls.obj", refused(obj(*joined(ball(), ball(center=(1, 0, 0)))), "2 components")
    yield "many_bodies.obj", refused(obj(*joined(*(ball(0.4, (i, 0, 0), 1) for i in range(40)))), "40 components")
    yield "shells.obj", refused(obj(*joined(ball(2.0), _turned_inside(*ball()))), "nested shells")
    yield "flat.obj", refused(obj(CUBE * [1, 1, 0], TRIANGLES), "")
    yield "sheet.obj", refused(obj(CUBE[:4], [[0, 2, 3], [0, 3, 1], [0, 3, 2], [0, 1, 3]]), "")
    yield "scan.obj", refused(_scan(3), "open surface: 3 boundary loops")
    yield "spike.obj", accepted(_spike(), "self-intersection")
    yield "huge.obj", accepted(obj(1e12 * CUBE), "unusual size")
    yield "tiny.obj", accepted(obj(1e-9 * CUBE), "unusual size")
    yield "far.obj", accepted(obj(CUBE + 1e7, QUADS), "far from the origin")


CASES = {
    **{name: accepted(*row) for name, row in ACCEPTED.items()},
    **{name: refused(*row) for name, row in REFUSED.items()},
    **dict(shapes()),
}
