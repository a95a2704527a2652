"""Options of a parameterization: frozen dataclasses, and the presets.

Lengths are in units of the domain scaled to volume 1. Constants that no user sets stand beside the code
that reads them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from numbers import Integral, Real
from typing import Literal, get_args

MAX_CONTROL_POINTS = 100  # per direction

StageName = Literal["S(2)", "S(1)", "cube", "corners", "edges"]
PresetName = Literal["fast", "grown", "paper"]
Device = Literal["auto", "cpu", "cuda"]  # where the network is trained; "auto" takes CUDA where it is available
# The ways as the command line writes them; `ways/strategy.py` says which body takes which.
WayName = Literal[
    "planes",
    "stacks",
    "hexahedra",
    "body-with-stubs",
    "blocks",
    "sharp-edges",
    "network",
    "growth",
    "stiff-growth",
    "last-growth",
    "last-hexahedra",
]


@dataclass(frozen=True)
class NetworkConfig:
    """Positional encoding and residual MLP (paper, section 4.2)."""

    width: int = 128
    modules: int = 4
    frequencies: int = 10
    scale: float = 1.0  # k of the encoding before the training


@dataclass(frozen=True)
class StageConfig:
    """A training stage, by its name in `training/losses.py`, and its number of steps."""

    name: StageName
    steps: int


@dataclass(frozen=True)
class TrainConfig:
    """Options of the training that all stages share."""

    learning_rate: float = 1e-3  # of Adam
    matrix_rate: float = 0.015  # of Muon, for the hidden layers' matrices; with 0 Adam trains these, too
    final_share: float = 0.02  # of both rates, reached by cosine decay at the end of each stage
    # Loss without distortion after the first stage above which the map is grown instead. 0: every map is grown, and
    # nothing is trained; None: every map is trained to the end first.
    easy_loss: float | None = 4.0  # a conch ends at 2.2 to 3.7, with the last bit and the seed, a bunny at 4.4 to 5.3
    # With 0.12 and 700 the training takes half as long again for maps as good; 0.18 and 300 distort a conch more.
    cell: float = 0.15  # edge h of the interior cells (section 4.4.2)
    triangles: int = 450  # surface triangles sampled in a step; all where there are fewer
    whiten: bool = True  # start from the affine map that makes the domain equally wide in all directions
    race: float = 0.45  # share of the first stage towards the cube that is trained twice: as G is, and turned


@dataclass(frozen=True)
class SplineConfig:
    """Fit and control-point optimisation (section 4.3.2); constants of the energy stand beside its terms."""

    control_points: int = 30
    degree: int = 3
    fit_cell: float = 0.035  # lattice of inverse samples
    rounds: int = 16  # at most, of a map that a trained network gives; other maps have some more
    steps: int = 60  # a round, at most

    def __post_init__(self) -> None:
        """Raise ValueError for a degree below 1, too few control points for it, and for numbers that are not whole."""
        for what, number in (("degree", self.degree), ("number of control points", self.control_points)):
            if not isinstance(number, Integral):
                raise ValueError(f"the {what} must be a whole number, got {number!r:.80}")
        if self.degree < 1:
            raise ValueError(f"the degree must be at least 1, got {self.degree}")
        if self.control_points <= self.degree:
            fewest = self.degree + 1
            raise ValueError(f"degree {self.degree} needs at least {fewest} control points, got {self.control_points}")

    @property
    def longest_edge(self) -> float:
        """Return the length at volume 1 above which the mesh's edges are cut: a span of the cube."""
        return 1.0 / (self.control_points - self.degree)


@dataclass(frozen=True)
class RefinementConfig:
    """When knots are inserted after the spline stage; refinement.py says where, and how the map is optimised then.

    tolerance: of the root mean square distance between the surface and the spline's boundary, taken both ways, over the
    diagonal of the surface's bounding box.
    max_control_points: a direction.
    """

    tolerance: float = 5e-4
    max_control_points: int = 60


@dataclass(frozen=True)
class Config:
    """All options of `parameterize.parameterize`.

    Attributes
    ----------
    name : str
        Of the preset it started as.
    network : NetworkConfig
    train : TrainConfig
    stages : tuple of StageConfig
    spline : SplineConfig
        Fit and optimisation, `control_points` a direction and `degree` among them.
    refinement : RefinementConfig or None
        Where knots are inserted after the spline stage; None: the control points of `spline` are all there are.
    starts : int
        The tries with one cube in all, at most 4: a shape that is hard to train is grown, see docs/ways.md.
    blocks : int or None
        The most blocks of a map: 1 for one cube, None for as many as suit the body; see docs/ways.md.
    ways : tuple of str
        The names of the ways that may be taken, in their order; all if it is empty.
    steps_factor : float
        By which `scaled` has lengthened all stages: it also counts for steps that no other option sets.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.preset("paper").network.width
    512
    """

    name: str
    network: NetworkConfig
    train: TrainConfig
    stages: tuple[StageConfig, ...]
    spline: SplineConfig
    starts: int = 4
    refinement: RefinementConfig | None = None
    blocks: int | None = None
    ways: tuple[str, ...] = ()
    steps_factor: float = 1.0

    def scaled(self, factor: float) -> Config:
        """Return the same options with `factor` (at most 100) times as many steps in every stage, at least one each.

        With fewer steps every shape looks hard: with a factor below 1 those that "fast" trains are trained to the end.
        """
        if not isinstance(factor, Real) or not 0.0 < factor <= 100.0:
            raise ValueError(f"steps factor must be a positive number, at most 100, got {factor!r:.80}")
        stages = tuple(replace(stage, steps=scaled_steps(stage.steps, factor)) for stage in self.stages)
        spline = replace(self.spline, steps=scaled_steps(self.spline.steps, factor))
        train = self.train if factor >= 1.0 or not self.train.easy_loss else replace(self.train, easy_loss=None)
        whole = factor * self.steps_factor
        return replace(self, train=train, stages=stages, spline=spline, steps_factor=whole)

    def holding_edges(self) -> Config:
        """Return the same options with the stages that hold corners and edges: corners that a user gives need them."""
        present = {stage.name for stage in self.stages}
        missing = (stage for stage in _HOLDING if stage.name not in present)
        added = (replace(stage, steps=scaled_steps(stage.steps, self.steps_factor)) for stage in missing)
        return replace(self, stages=(*self.stages, *added))

    def refined(self, tolerance: float, max_control_points: int) -> Config:
        """Return the same options with knots inserted until a tolerance is met, see RefinementConfig.

        Raises ValueError for a tolerance that is not positive, and for fewer control points than there are already, too
        many, or no whole number.
        """
        if not isinstance(tolerance, Real) or not 0.0 < tolerance < inf:
            raise ValueError(f"tolerance must be positive and finite, got {tolerance!r:.80}")
        if not isinstance(max_control_points, Integral):
            raise ValueError(f"max_control_points must be a whole number, got {max_control_points!r:.80}")
        fewest = self.spline.control_points
        if not fewest <= max_control_points <= MAX_CONTROL_POINTS:
            given = f"between {fewest}, the number of the first map, and {MAX_CONTROL_POINTS}"
            raise ValueError(f"max_control_points must lie {given}, got {max_control_points}")
        return replace(self, refinement=RefinementConfig(tolerance, max_control_points))

    def with_blocks(self, blocks: int | None) -> Config:
        """Return the same options with at most so many blocks; None for as many as suit the body.

        Raises ValueError for a number that is not whole or not positive.
        """
        if blocks is not None and (not isinstance(blocks, Integral) or isinstance(blocks, bool) or blocks < 1):
            raise ValueError(f"blocks must be auto (None in Python) or a whole number from 1 on, got {blocks!r:.80}")
        return replace(self, blocks=blocks)

    def with_control_points(self, n: int) -> Config:
        """Return the same options with n x n x n control points.

        Raises ValueError for too few, too many, or no whole number.
        """
        spline = replace(self.spline, control_points=n)
        if n > MAX_CONTROL_POINTS:
            raise ValueError(f"at most {MAX_CONTROL_POINTS} control points per direction can be run, got {n}")
        return replace(self, spline=spline)


def scaled_steps(steps: int, factor: float) -> int:
    """Return `factor` times as many steps, at least one."""
    return max(1, round(factor * steps))


def _stages(*steps: int) -> tuple[StageConfig, ...]:
    """Return the first ones of the five stages with these numbers of steps."""
    return tuple(StageConfig(name, count) for name, count in zip(get_args(StageName), steps, strict=False))


_HOLDING = (StageConfig("corners", 15), StageConfig("edges", 30))
# The default has no stages that hold corners and edges: on seven models maps are as good without them (ARAP 1.01 times,
# distance 1.01 times). With 30 steps towards S(1) the maps of two flat hard surfaces meet themselves.
_FAST = Config("fast", NetworkConfig(scale=3.14), TrainConfig(), _stages(90, 60, 45), SplineConfig())
PRESETS: dict[PresetName, Config] = {
    "fast": _FAST,
    "grown": replace(_FAST, name="grown", train=replace(_FAST.train, easy_loss=0.0)),
    "paper": Config(
        "paper",
        NetworkConfig(width=512, modules=6),
        TrainConfig(
            learning_rate=5e-4,
            matrix_rate=0.0,
            final_share=1.0,
            easy_loss=None,
            cell=0.04,
            triangles=1_000_000,
            whiten=False,
            race=0.0,
        ),
        _stages(600, 400, 1000, 500, 1000),
        SplineConfig(),
        starts=1,  # without `whiten` every start would be the same
    ),
}


def preset(name: str) -> Config:
    """Return a set of options by its name.

    Parameters
    ----------
    name : str
        "fast", the default, made for two CPU cores; "grown", the same with every map grown from a cube, as hard shapes
        are; or "paper", the paper's network and steps: hours without a GPU.

    Raises
    ------
    ValueError
        For another name.

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.5).with_control_points(20)
    >>> config.spline.control_points, config.stages[0].steps
    (20, 45)
    """
    for known, config in PRESETS.items():
        if name == known:
            return config
    raise ValueError(f"unknown preset {name!r}: choose one of {', '.join(PRESETS)}")
