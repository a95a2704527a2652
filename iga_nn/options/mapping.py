"""Holds the options of a surface and of the map that is made from it, whose defaults and choices are those of `Config`.

Annotations are evaluated in this module: a subclass in another module would look up their names in that module.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

from parameterize.config import Config, Device, PresetName, RefinementConfig, SplineConfig, WayName
from parameterize.config import preset as config_of

from ..errors import InputError, input_errors
from ..type_check import Checked


@dataclass(frozen=True, kw_only=True)
class SurfaceOptions(Checked):
    """Hold the options of the surface that is read from a file.

    Attributes:
        component: connected component to use, where there are several: its number, 0 has most faces, or "largest", the
            one of the largest volume.
        close: fill holes by smooth patches, and say how much area they add; "all" also fills loops longer than a
            quarter of the box's diagonal, and more than 5 % of the area.
        deflection: of a solid model (STEP, IGES), the largest distance of the triangles from its curved faces, in the
            file's unit; a thousandth of the box's diagonal by default.
        max_faces: refuse surfaces with more faces; where it is not given, reduce them to 500 000, as decimate does.
        decimate: reduce surfaces with more faces to max_faces instead; a notice has the distance from the original.
        sharp: an edge is sharp where its triangles meet at more than so many degrees; edges of the cube and of blocks
            follow sharp edges.
    """

    component: int | Literal["largest"] | None = None
    close: bool | Literal["all"] = False
    deflection: float | None = None
    max_faces: int = 500_000
    decimate: bool = False
    sharp: float = 40.0

    def reading(self) -> dict[str, Any]:
        """Return the keywords of `models.resolve`."""
        return {field.name: getattr(self, field.name) for field in fields(SurfaceOptions)}


@dataclass(frozen=True)
class MapOptions(SurfaceOptions):
    """Hold the options of the map from the cube to the solid inside a surface.

    Attributes:
        preset: "fast", made for two CPU cores; "grown", where every map grows from a cube, also of easy shapes; or
            "paper", the paper's own settings.
        seed: equal seeds give equal volumes, bit for bit.
        device: where the network is trained; "auto" takes CUDA where it is available.
        control_points: number of control points per direction; "auto" starts with 30 and adds more where the distance
            is large, for each direction apart, until it meets the tolerance or max_control_points is reached. Several
            blocks have a fifth as many spans across each, at least 4.
        blocks: 1 for one cube, a larger number for at most so many blocks, or "auto" for as many as suit the body, see
            docs/ways.md.
        ways: the ways to a map that may be taken, in their order, such as planes stacks; all by default.
        corners: JSON file with a list of eight corners, in the order (0,0,0), (0,0,1), (0,1,0), ..., (1,1,1) of the
            cube's: points of three coordinates in the surface's units, or vertex numbers counted from 0; or an object
            {"XYZ": [...]} with eight points in X, Y, Z, scaled to volume 1 about the middle of the bounding box.
            Refused for a body with handles, and with blocks above 1.
        resume: continue from the checkpoint in the output folder.
        steps_factor: factor of the training steps of every stage; a small factor gives a quick look.
        tolerance: largest root mean square distance between surface and spline for control_points "auto", in both
            directions, over the diagonal of the surface's bounding box.
        max_control_points: largest number per direction for control_points "auto", 30 or more.

    Examples:
        >>> import iga_nn
        >>> iga_nn.MapOptions(control_points=20, steps_factor=0.5).config().spline.control_points
        20
    """

    preset: PresetName = "fast"
    seed: int = 0
    device: Device = "auto"
    control_points: int | Literal["auto"] = SplineConfig.control_points
    blocks: int | Literal["auto"] = "auto"
    ways: tuple[WayName, ...] = ()
    corners: Path | None = None
    resume: bool = False
    steps_factor: float = Config.steps_factor
    tolerance: float = RefinementConfig.tolerance
    max_control_points: int = RefinementConfig.max_control_points

    def config(self) -> Config:
        """Return the configuration of these options. Raises InputError for values that cannot be run."""
        if self.seed < 0:
            raise InputError(f"seed {self.seed}: must not be negative")
        with input_errors():
            config = config_of(self.preset).scaled(self.steps_factor)
            if self.corners is not None:
                config = config.holding_edges()
            config = config.with_blocks(None if self.blocks == "auto" else self.blocks)
            config = replace(config, ways=tuple(dict.fromkeys(way.replace("-", " ") for way in self.ways)))
            if self.control_points == "auto":
                return config.refined(self.tolerance, self.max_control_points)
            for name in ("tolerance", "max_control_points"):
                if getattr(self, name) != getattr(MapOptions, name):
                    raise InputError(f"{name.replace('_', ' ')}: requires --control-points auto")
            return config.with_control_points(self.control_points)

    @property
    def most_control_points(self) -> int:
        """Return the largest number of control points that a direction may have."""
        return self.max_control_points if self.control_points == "auto" else self.control_points
