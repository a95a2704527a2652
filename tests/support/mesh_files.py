"""A cube and other small meshes, and the text or bytes of the files that hold them."""

import struct

import numpy as np
import trimesh

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]  # outward
TRIANGLES = np.array([[q[0], q[i], q[i + 1]] for q in QUADS for i in (1, 2)])
MIXED = [*QUADS[:3], *TRIANGLES[6:].tolist()]
TETRAHEDRON = (np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


def ball(radius=1.0, center=(0.0, 0.0, 0.0), subdivisions=2):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(mesh.vertices) + center, np.asarray(mesh.faces)


def joined(*parts):
    offsets = np.cumsum([0] + [len(v) for v, _ in parts])
    faces = [f + offset for (_, f), offset in zip(parts, offsets, strict=False)]
    return np.concatenate([v for v, _ in parts]), np.concatenate(faces)


def obj(vertices=CUBE, faces=QUADS):
    rows = ["v {!r} {!r} {!r}".format(*v) for v in np.asarray(vertices).tolist()]
    return "\n".join(rows + ["f " + " ".join(str(i + 1) for i in face) for face in faces]) + "\n"


def binary_stl(vertices=CUBE, faces=TRIANGLES, header=b"made by code"):
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[face].ravel(), 0) for face in faces)
    return header.ljust(80, b"\0") + struct.pack("<I", len(faces)) + rows


def text_stl(vertices=CUBE, faces=TRIANGLES):
    rows = ["solid cube"]
    for face in faces:
        corners = ["vertex {} {} {}".format(*vertices[i]) for i in face]
        rows += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
    return "\n".join([*rows, "endsolid cube", ""])


def off(vertices=CUBE, faces=QUADS, counts=None):
    n, m = counts or (len(vertices), len(faces))
    rows = ["OFF", f"{n} {m} 0", *("{} {} {}".format(*v) for v in vertices)]
    return "\n".join(rows + [" ".join(map(str, [len(f), *f])) for f in faces]) + "\n"


def ply(vertices=CUBE, faces=TRIANGLES, counts=None, binary=False):
    n, m = counts or (len(vertices), len(faces))
    head = f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex {n}\n"
    head += "".join(f"property float {a}\n" for a in "xyz")
    head += f"element face {m}\nproperty list uchar int vertex_indices\nend_header\n"
    if binary:
        body = b"".join(struct.pack("<3f", *v) for v in vertices)
        return head.encode() + body + b"".join(struct.pack(f"<B{len(f)}i", len(f), *f) for f in faces)
    rows = ["{} {} {}".format(*v) for v in vertices] + [" ".join(map(str, [len(f), *f])) for f in faces]
    return (head + "\n".join(rows) + "\n").encode()


def medit(version="MeshVersionFormatted 2\nDimension 3", more=""):
    rows = [version, "Vertices\n8", *("{} {} {} 0".format(*v) for v in CUBE)]
    rows += [more, "Triangles\n12", *("{} {} {} 0".format(*(face + 1)) for face in TRIANGLES)]
    return "\n".join([*rows, "Tetrahedra\n0", "End", ""])


def flagged_ply(faces=TRIANGLES, vertices=CUBE, binary=False):
    """Faces with a property beside the corners."""
    head, mark, body = ply(vertices, faces, binary=binary).partition(b"end_header\n")
    head += b"property uchar flags\n" + mark
    if binary:
        start, row = 12 * len(vertices), 1 + 4 * len(faces[0])
        return head + body[:start] + b"".join(body[i : i + row] + b"\7" for i in range(start, len(body), row))
    rows = body.decode().splitlines()
    n = len(vertices)
    return head + "\n".join([*rows[:n], *(row + " 7" for row in rows[n:]), ""]).encode()
