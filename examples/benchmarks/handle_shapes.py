"""Closed surfaces with handles and with limbs, by name, each with the genus it is made to have.

    python examples/benchmarks/handle_shapes.py out/shapes

writes them all as NAME.obj. They are made by formula: the same surface each time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import everyday_machined as workshop
import everyday_smooth as house
import limbed_shapes as limbed
import machined_shapes as machined
import smooth_shapes as smooth
from distance_fields import Triangles, has_genus
from processes import compute_measured

from iga_nn.batch.task import Task
from iga_nn.workflow.worker_run import Ended
from parameterize.files import save_text
from parameterize.surface.surface import MeshError
from parameterize.surface.topology import crossing_faces


@dataclass(frozen=True)
class Shape:
    """How a surface is made, and its number of handles."""

    make: Callable[[], Triangles]
    genus: int

    def triangles(self) -> Triangles:
        """Return vertices (n, 3) and faces (m, 3), closed, in one piece, of that genus.

        Raises
        ------
        MeshError
            Where the surface is not as it is meant to be, or intersects itself.
        """
        vertices, faces = self.make()
        if not has_genus(faces, self.genus):
            raise MeshError(f"{self.make.__name__}: is no closed surface of genus {self.genus}; change its formula")
        if len(crossing_faces(vertices, faces)):
            raise MeshError(f"{self.make.__name__}: intersects itself; change its formula")
        return vertices, faces


HANDLES = {  # the surfaces on which the method is developed
    "torus": Shape(smooth.thick_torus, 1),
    "thin_torus": Shape(smooth.thin_torus, 1),
    "trefoil": Shape(smooth.trefoil, 1),
    "mug": Shape(smooth.mug, 1),
    "double_torus": Shape(smooth.double_torus, 2),
    "triple_torus": Shape(smooth.triple_torus, 3),
    "twisted_double_torus": Shape(smooth.twisted_double_torus, 2),
    "plate_1": Shape(machined.plate_1, 1),
    "plate_4": Shape(machined.plate_4, 4),
    "plate_6": Shape(machined.plate_6, 6),
    "bracket_4": Shape(machined.bracket_4, 4),
    "frame": Shape(machined.frame, 5),
}
KNOTTED = {"knotted_tunnel": Shape(smooth.knotted_tunnel, 1)}  # no graph in space is its skeleton: to be refused
EVERYDAY = {  # surfaces to which nothing is tuned
    "chain_link": Shape(house.chain_link, 1),
    "hook_with_eye": Shape(house.hook_with_eye, 1),
    "carabiner": Shape(house.carabiner, 1),
    "kettle": Shape(house.kettle, 1),
    "wrench": Shape(house.wrench, 1),
    "knot_5_1": Shape(smooth.knot_5_1, 1),
    "pipe_elbow": Shape(workshop.pipe_elbow, 1),
    "cup_with_two_handles": Shape(smooth.cup_with_two_handles, 2),
    "eyeglasses": Shape(house.eyeglasses, 2),
    "scissors": Shape(house.scissors, 2),
    "chair": Shape(workshop.chair, 2),
    "hand_truck": Shape(house.hand_truck, 4),
    "ladder": Shape(workshop.ladder, 4),
    "table": Shape(workshop.table, 4),
    "ribbed_bracket": Shape(workshop.ribbed_bracket, 4),
    "hinge": Shape(workshop.hinge, 5),
    "fence": Shape(workshop.fence, 5),
    "spoked_wheel": Shape(workshop.spoked_wheel, 6),
    "gear": Shape(workshop.gear, 6),
    "flange": Shape(workshop.flange, 7),
    "lattice_cell": Shape(house.lattice_cell, 12),
}
LIMBS = {
    "hand": Shape(limbed.hand, 0),
    "octopus": Shape(limbed.octopus, 0),
    "dog": Shape(limbed.dog, 0),
    "starfish": Shape(limbed.starfish, 0),
    "gecko": Shape(limbed.gecko, 0),
    "brittle_star": Shape(limbed.brittle_star, 0),
    "giraffe": Shape(limbed.giraffe, 0),
    "mannequin": Shape(limbed.mannequin, 0),
    "ant": Shape(limbed.ant, 0),
}
SHAPES = HANDLES | KNOTTED | EVERYDAY | LIMBS


def write(name: str, shape: Shape, path: Path) -> None:
    """Write a surface as OBJ under a name, with every digit of its coordinates."""
    vertices, faces = shape.triangles()
    rows = [f"# {name}: {len(vertices)} vertices, {len(faces)} faces, genus {shape.genus}"]
    rows += [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    save_text(path, "\n".join(rows) + "\n")


def compute_named(task: Task, number: int, batch: str) -> Ended:
    """Make the surface that `task` names where its mesh is not there; then compute it, measured."""
    try:
        if not Path(task.mesh).is_file():
            write(task.name, SHAPES[task.name], Path(task.mesh))
    except MeshError as error:
        return Ended("refused", str(error))
    return compute_measured(task, number, batch)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name in SHAPES:
        write(name, SHAPES[name], folder / f"{name}.obj")
        print(folder / f"{name}.obj")
