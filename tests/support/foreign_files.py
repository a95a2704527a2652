"""Geometry files of other programs that are only read here, as text."""

import numpy as np

from iga_nn.io.mfem_layout import CORNERS
from parameterize.spline.body import Body
from parameterize.spline.volume import FACE_NAMES


def row(values):
    return " ".join(map(repr, np.asarray(values).tolist()))


def geopdes_patch(volume, name=None, scale=1.0):
    """Homogeneous control points; all weights are multiplied by `scale`."""
    lines = [name] if name else []
    lines += [row(volume.degrees), row(volume.shape), *map(row, volume.knots)]
    weights = scale * (np.ones(volume.shape) if volume.weights is None else volume.weights)
    return lines + [row((weights * x).ravel(order="F")) for x in (*np.moveaxis(volume.control_points, -1, 0), 1.0)]


def geopdes(body: Body, head="# nurbs mesh v.2.1\n#\n# 24-Jun-2015\n#\n", scale=1.0):
    """Patches, interfaces with their orientation, a subdomain and a boundary, as `nrbexport` of the NURBS toolbox."""
    lines = [f" 3 3 {len(body)} {len(body.interfaces)} 1"]
    for number, patch in enumerate(body):
        lines += geopdes_patch(patch, f"PATCH {number + 1} ", scale)
    for number, interface in enumerate(body.interfaces):
        lines.append(f"INTERFACE {number + 1} ")
        lines += [f"{p + 1} {FACE_NAMES.index(face) + 1}" for p, face in (interface.first, interface.second)]
        lines.append(row([-1 if flag else 1 for flag in (interface.swapped, *interface.flipped)]))
    lines += ["SUBDOMAIN 1 ", row([number + 1 for number in range(len(body))]), "BOUNDARY 1 ", "1", "1 1", ""]
    return head + "\n".join(lines)


def geopdes_07(volume):
    """One patch without a name."""
    return "# nurbs mesh v.0.7\n# a patch\n3 1\n# its degrees\n" + "\n".join(geopdes_patch(volume)) + "\n"


def mfem_patches(kind="controlpoints", weight=1):
    """Two unit cubes; the second is turned about the third axis by half a turn. Edges are left to MFEM."""
    cubes = ("0 0 0|1 0 0|0 1 0|1 1 0|0 0 1|1 0 1|0 1 1|1 1 1", "2 1 0|1 1 0|2 0 0|1 0 0|2 1 1|1 1 1|2 0 1|1 0 1")
    scale = 1 if kind == "controlpoints_cartesian" else weight
    patches = []
    for cube in cubes:
        rows = [[scale * float(c) for c in point.split()] + [weight] for point in cube.split("|")]
        patches += ["knotvectors", "3", *["1 2 0 0 1 1"] * 3, "", "dimension", "3", "", kind, *map(row, rows), ""]
    head = "MFEM NURBS mesh v1.0\n\n# Two cubes.\n\ndimension\n3\n\nelements\n2\n"
    head += "1 5 0 1 4 3 6 7 10 9\n1 5 5 4 1 2 11 10 7 8\n\nboundary\n0\n\nedges\n0\n\nvertices\n12\n\npatches\n"
    return "\n".join([head, *patches])


def mfem_shuffled(body: Body, seed=0):
    """The patches of a right-handed body in MFEM's format, with their vertices numbered at random."""
    corners = [patch.control_points[np.ix_(*[[0, -1]] * 3)] for patch in body]
    points = np.unique(np.round(np.reshape(corners, (-1, 3)), 9), axis=0)
    points = np.random.default_rng(seed).permutation(points)
    hexahedra = [[int(np.abs(points - net[corner]).sum(axis=1).argmin()) for corner in CORNERS] for net in corners]
    lines = [
        "MFEM NURBS mesh v1.0",
        "dimension",
        "3",
        "elements",
        str(len(body)),
        *(f"1 5 {row(h)}" for h in hexahedra),
    ]
    lines += ["boundary", "0", "edges", "0", "vertices", str(len(points)), "patches"]
    for patch in body:
        vectors = [f"{p} {len(k) - p - 1} {row(k)}" for p, k in zip(patch.degrees, patch.knots, strict=True)]
        net = patch.control_points.transpose(2, 1, 0, 3).reshape(-1, 3)
        lines += [
            "knotvectors",
            "3",
            *vectors,
            "dimension",
            "3",
            "controlpoints",
            *(f"{row(point)} 1" for point in net),
        ]
    return "\n".join(lines) + "\n"
