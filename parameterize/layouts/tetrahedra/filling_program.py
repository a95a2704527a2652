"""A program of its own: tetrahedra inside closed coarse triangles, by Netgen.

`from_triangles.py` runs it with an .npz of points (n, 3), triangles (m, 3) and sides (m, 2), the solids in and outside
of each, counted from 1, and with the .npz to write. It imports netgen and numpy alone.
"""

import sys

import numpy as np
from netgen.meshing import FaceDescriptor, Mesh, SetMessageImportance

GRADING = 0.7  # how fast edges may grow inwards


def main(source: str, target: str) -> None:
    """Write points (k, 3), the given ones first, cells (t, 4) of positive volume, and solids (t,), from 1 on."""
    SetMessageImportance(0)
    with np.load(source) as given:
        points, triangles, sides = given["points"], given["triangles"], given["sides"]
    mesh = Mesh()
    mesh.AddPoints(np.ascontiguousarray(points))
    for number, (inside, outside) in enumerate(np.unique(sides, axis=0).tolist(), 1):
        mesh.Add(FaceDescriptor(surfnr=number, domin=inside, domout=outside, bc=number))
        chosen = (sides == (inside, outside)).all(axis=1)
        mesh.AddElements(dim=2, index=number, data=np.ascontiguousarray(triangles[chosen], dtype=np.int32), base=0)
    mesh.GenerateVolumeMesh(maxh=1e10, grading=GRADING)
    if not mesh.ne:
        raise ValueError("it finds no tetrahedra")
    found = mesh.Elements3D().NumPy()
    cells = np.asarray(found["nodes"], dtype=np.int64)[:, :4] - 1
    np.savez(
        target, points=np.array(mesh.Coordinates()), cells=cells[:, [1, 0, 2, 3]], solids=np.asarray(found["index"])
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
