"""Options of a parameterization: frozen dataclasses, and the presets.

Lengths are in units of the domain scaled to volume 1. Loss weights are those of the paper's Table 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from numbers import Integral, Real
from typing import Literal

MAX_CONTROL_POINTS = 100  # per direction

Target = Literal["S(2)", "S(1)", "cube"]


@dataclass(frozen=True)
class NetworkConfig:
    """Positional encoding and residual MLP (paper, section 4.2)."""

    width: int = 128
    modules: int = 4
    frequencies: int = 10
    scale: float = 1.0  # k of the encoding before training


@dataclass(frozen=True)
class StageWeights:
    """One row of the paper's Table 1."""

    bij: float = 1e6
    arap: float = 1.0
    fair: float = 2e-3
    dist: float = 1e3
    norm: float = 10.0
    star: float = 1e3
    cor: float = 0.0
    edge: float = 0.0


@dataclass(frozen=True)
class StageConfig:
    """One training stage: its name, the shape to reach, its length and its weights."""

    name: str
    target: Target
    steps: int
    weights: StageWeights
    given_corner_weight: float = 1e2  # used from the first stage on where the user gives corners (section 5.4)


@dataclass(frozen=True)
class TrainConfig:
    """What the four stages share."""

    learning_rate: float = 1e-3  # of Adam
    matrix_rate: float = 0.015  # of Muon, for the hidden layers' matrices; Adam trains these, too, where it is 0
    final_share: float = 0.02  # of the rates, reached by cosine decay at the end of each stage
    easy_loss: float | None = (
        3.5  # where the first stage ends with more, distortion left out, the map is grown instead;
    )
    # 0: every map is grown, and nothing is trained; None: none is grown before it is trained to the end
    cell: float = 0.12  # edge h of the interior cells (section 4.4.2)
    triangles: int = 700  # surface triangles sampled a step; all of them where there are fewer
    min_det: float = 0.1  # alpha of the bijectivity term
    wrong_side: float = 100.0  # weight of normals that point inwards, within the normal term
    whiten: bool = True  # start from the affine map that makes the domain as wide in all directions, not the identity
    det_floor: float = 0.5  # share of `min_det` at which the distortion term holds smaller determinants
    edge_direction: float = 1e-3  # weight of the paths' directions, within the edge term
    race: float = 0.45  # share of the first stage towards the cube that is trained twice: as G is, and turned
    race_steps: int = 8  # the last ones of these, whose distortions are compared
    race_gain: float = 0.05  # share by which the turned G must be better, in hollows and then in distortion


@dataclass(frozen=True)
class SplineConfig:
    """Fit and control-point optimisation (section 4.3.2); weights refer to a domain of volume 1."""

    control_points: int = 30
    degree: int = 3
    fit_cell: float = 0.035  # lattice of inverse samples
    rounds: int = 16  # at most, of a map that a trained network gives; other maps have some more
    steps: int = 60  # a round, at most

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
class LayoutConfig:
    """How the surface is cut and laid out on the cube; a share is one of a mesh edge's length."""

    path_snap: float = 0.1  # share: crossings nearer to a vertex than this take the vertex, so paths leave no slivers
    stray: float = 20.0  # a path costs so many times more at the distance `stray_cell` from its cube edge
    stray_cell: float = 0.05
    orders: int = 24  # in which the paths are traced, at most
    sweeps: int = 600  # of relaxation, at most
    patience: int = 60  # sweeps after which one more ring of neighbours may move
    pushes: int = 100  # sweeps that push the corners of flipped triangles alone, at most
    unflipped: float = 1e-2  # share of the median triangle that one so pushed takes
    held_rounds: int = 20  # in which points are held so that no further triangle flips, at most
    same: float = 1e-7  # share: final cuts this close to a vertex take the vertex
    nudge: float = 1e-4  # by which vertices move where a mesh edge runs through a corner of the cube
    nudges: int = 10  # at most
    settle_steps: int = 8  # Gauss-Newton steps of the final cuts along their edges
    settle_damping: float = 1e-3  # of these, against parallel directions
    settle_margin: float = 1e-2  # share that a cut keeps from the ends of its edge
    undo_rounds: int = 10  # in which such steps are undone at flipped triangles, at most
    least_share: float = 0.25  # that the line which halves a surface keeps from the ends of the edges it divides
    squeezed: float = 1e8  # energy of the first layout on the sphere (at rest some 50) above which others are tried
    along: float = 10.0  # weight of edges that lead away from that line, in addition, in the first of the others
    sharpness: tuple[int, ...] = (2, 4, 8, 16, 32, 64)  # in the next ones: the higher, the straighter edges count
    one_way: tuple[int, ...] = (4, 16)  # likewise in the last ones, where edges count from their far end alone
    sphere_steps: int = 300  # of Newton's method for the layout on the sphere, at most
    usual_sphere_steps: int = 30  # of most surfaces: tells the time left
    sphere_damping: float = 1e-8  # of these, as a share of the mean diagonal entry
    sphere_gain: float = 1e-3  # the steps end once one lowers the energy by less than this share
    turns: int = 200  # of the cube in that layout, drawn at random
    finals: int = 5  # the best of them, which are turned further
    turn_steps: int = 60  # of each of these, at most
    turn_size: float = 0.1  # of the first of these steps, as an angle
    other_turn: float = 0.3  # a turn that differs from a better one by a larger angle counts as another
    edge_width: float = 0.15  # from the cube's edges, within which the surface should not be hollow
    edge_pieces: int = 24  # of each cube edge: one that lies in a hollow is not made up for by ridges beside it
    hollow: float = 1.0  # times its bend that such a piece counts in addition


LAYOUT = LayoutConfig()


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
    layout : LayoutConfig
    refinement : RefinementConfig or None
        Where knots are inserted after the spline stage; None: the control points of `spline` are all there are.
    starts : int
        The tries in all, at most 5: where a shape is hard to train, or the trained map is not certified, one is grown.
        Where that is not certified or meets itself, a layout is extended and a stiffer map grown; in the end one that
        may be farther from the surface.
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
    layout: LayoutConfig = LAYOUT
    starts: int = 5
    refinement: RefinementConfig | None = None
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
            given = f"between {fewest} and {MAX_CONTROL_POINTS}, got {max_control_points}"
            raise ValueError(f"max_control_points must lie {given}")
        return replace(self, refinement=RefinementConfig(tolerance, max_control_points))

    def with_control_points(self, n: int) -> Config:
        """Return the same options with n x n x n control points.

        Raises ValueError for too few, too many, or no whole number.
        """
        if not isinstance(n, Integral):
            raise ValueError(f"the number of control points must be a whole number, got {n!r:.80}")
        if n <= self.spline.degree:
            fewest = self.spline.degree + 1
            raise ValueError(f"degree {self.spline.degree} needs at least {fewest} control points, got {n}")
        if n > MAX_CONTROL_POINTS:
            raise ValueError(f"at most {MAX_CONTROL_POINTS} control points per direction can be run, got {n}")
        return replace(self, spline=replace(self.spline, control_points=n))


def scaled_steps(steps: int, factor: float) -> int:
    """Return `factor` times as many steps, at least one."""
    return max(1, round(factor * steps))


def _stages(steps: tuple[int, int, int, int, int]) -> tuple[StageConfig, ...]:
    """Return the stages of section 4.3.1 with the weights of Table 1; S(2) and S(1) are the paper's first stage."""
    free, tight = StageWeights(), StageWeights(dist=1e4, cor=1e3)
    return (
        StageConfig("S(2)", "S(2)", steps[0], free),
        StageConfig("S(1)", "S(1)", steps[1], free),
        StageConfig("cube", "cube", steps[2], free),
        StageConfig("corners", "cube", steps[3], tight),
        StageConfig("edges", "cube", steps[4], replace(tight, edge=1e4)),
    )


_FAST = Config("fast", NetworkConfig(scale=3.14), TrainConfig(), _stages((90, 60, 90, 30, 60)), SplineConfig())
PRESETS = {
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
        _stages((600, 400, 1000, 500, 1000)),
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
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"unknown preset {name!r}: choose one of {', '.join(PRESETS)}")
    return PRESETS[name]
