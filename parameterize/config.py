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


@dataclass(frozen=True)
class NetworkConfig:
    """Positional encoding and residual MLP (paper, section 4.2)."""

    width: int = 128
    modules: int = 4
    frequencies: int = 10
    scale: float = 1.0  # k of the encoding before the training


@dataclass(frozen=True)
class StageConfig:
    """A training stage, by its name in `training/stages.py`, and its number of steps."""

    name: StageName
    steps: int


@dataclass(frozen=True)
class TrainConfig:
    """Options of the training that all stages share."""

    learning_rate: float = 1e-3  # of Adam
    matrix_rate: float = 0.015  # of Muon, for the hidden layers' matrices; with 0 Adam trains these, too
    final_share: float = 0.02  # of both rates, reached by cosine decay at the end of each stage
    easy_loss: float | None = 3.5  # loss without distortion after the first stage above which the map is grown instead
    cell: float = 0.12  # edge h of the interior cells (section 4.4.2)
    triangles: int = 700  # surface triangles sampled in a step; all of them where there are fewer
    whiten: bool = True  # start from the affine map that makes the domain equally wide in all directions
    race: float = 0.45  # share of the first stage towards the cube that is trained twice: as G is, and turned


@dataclass(frozen=True)
class GrowthConfig:
    """How F grows from a cube into a solid that is hard for the network: rounds before those of the spline stage."""

    turn: int = 0  # of the cube: 0 is the best found, 1 the next, and so on
    shares: tuple[float, ...] = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)  # of `vertex`
    steps: int = 12  # a round, at most
    coarse: float = 1 / 3  # in these rounds, in place of the spline stage's
    slides: int = 1  # likewise
    penalty: float = 2500.0  # on det J, in these rounds and all later ones
    reach: float = 0.03  # surface points farther from F than this do not slide, and draw F in all directions
    far: float = 0.005  # in place of the spline stage's: after the first round that follows, and in all where larger
    rounds: int = 20  # of the spline stage, after these, at most
    patient_rounds: int = 2  # in place of the spline stage's
    firm_rounds: int = 6  # likewise
    usual_steps: tuple[int, ...] = (40, 12, 8, 8, 8, 7, 6, 6, 6)  # of the rounds after these
    stiffness: float = 1.0  # times the spline stage's `fairness`
    least_floor: float = 1.0  # in place of the spline stage's


# Where the first growth fails: far thinner parts keep their small det J, and what is squeezed does not buckle.
STIFF = GrowthConfig(turn=1, far=0.01, firm_rounds=12, stiffness=10.0, least_floor=0.05)
# Where all else fails: a certified map that is far from the surface is worth more than none.
LAST = replace(STIFF, turn=2, far=0.05)


@dataclass(frozen=True)
class ExtensionConfig:
    """How the surface's layout on the cube is extended into the solid, and the spline stage that follows."""

    cell: float = 0.0255  # of the lattice, in a domain of volume 1
    tolerance: float = 1e-6  # of the linear solves, relative
    penalty: float = 2500.0  # on det J, in all rounds
    rounds: int = 20  # in place of the spline stage's
    usual_steps: tuple[int, ...] = (40, 12, 8, 8, 8, 7, 6, 6, 6)  # likewise


@dataclass(frozen=True)
class SplineConfig:
    """Fit and control-point optimisation (section 4.3.2); weights refer to a domain of volume 1."""

    control_points: int = 30
    degree: int = 3
    most_points: int = 30_000  # added where long edges of the mesh are cut: else they are cut less finely
    fit_cell: float = 0.035  # lattice of inverse samples
    fit_fairness: float = 1e-7
    boundary_share: float = 0.2  # weight of the surface's samples in the first fit; those inside have the rest of 1
    few_flips: float = 1e-2  # with a larger share of flipped triangles the surface is cut along traced cube edges
    gauss: int = 3  # Gauss points a direction in the distortion term, on the first and last span
    inner_gauss: int = 1  # likewise on the others
    fairness: float = 1e-3
    vertex: float = 1.2e5  # squared distance along the surface normal
    arap_limit: float = 6.0  # distortion above this costs `stiffening` times its squared excess, too
    stiffening: float = 3.0
    anchors: float = 0.03  # share of `vertex` for the distance along the cube's edges, from F to the surface
    near_edge: float = 0.5  # anchors closer to the surface than this share of a span's length count as near
    near_share: float = 0.99  # the anchors act from the first round on if at least this share of them is near
    given_corner: float = 0.5  # share of `anchors` that holds a corner given by the user, in all directions
    tangential: float = 2e-4  # share of `vertex` for the distance within the tangent plane
    min_det: float = 0.15  # det J below this is penalised at the Gauss points; mean det J is 1
    min_coefficient: float = 0.1  # likewise its Bernstein coefficients, on spans at cube edges or not proved
    most_watched: int = 1000  # spans: where more are not proved, the Gauss points have to unfold most of them first
    least_floor: float = 1.0  # share to which these two are lowered, at most, where det J is small all around
    min_facing: float = 0.1  # likewise (t_a x t_b) . n of the boundary's tangents and the mesh's normals
    facing_margin: float = 3.0  # times `min_facing`: points below may fall under it in the next step and are watched
    gap: float = 1e-3  # sheets of a boundary that meets itself are pushed so far apart
    contact: float = 10.0  # share of `vertex` for the squared depth by which they miss that
    contact_way: float = 0.0625  # factor of the surface's weights there, each round
    penalties: tuple[float, ...] = (20.0, 100.0, 500.0, 2500.0)  # one a round, then the last one again
    rounds: int = 16  # at most
    coarse: float = 5 / 9  # of the spans a direction, in the first rounds
    coarse_rounds: int = 2
    polish: int = 6  # of them, after the map is certified for the first time, at most
    stalling: int = 8  # rounds in which the unproved spans are not halved; they then end without a certified map
    far: float = 0.02  # from the surface, root mean square; the rounds then end without a certified map, too
    parting: int = 6  # rounds before the polish, while the boundary of a certified map meets itself, at most
    parted: float = 0.01  # from the surface, root mean square; these rounds then end with a boundary that meets itself
    patient_rounds: int = 2  # after these the anchors let go, and the penalty grows at unproved spans
    span_growth: float = 5.0  # factor of the penalty's weight there, each round
    span_most: float = 125.0  # of these factors together
    firm_rounds: int = 4  # after these the surface gives way at unproved spans
    giving_way: float = 0.25  # factor of its weights there, each round: an edge in a valley cannot lie on the surface
    smoothing_rounds: int = 2  # in which the unproved spans are not halved; F is then smoothed there
    most_smoothed: int = 10  # spans that stay unproved: to smooth F near more of them would take its shape away
    smoothing_tolerance: float = 1e-8  # of the solve for this, relative
    smoothing_iterations: int = 5000  # of it, at most
    mendings: int = 6  # times that more is moved back to where it was certified, at most
    steps: int = 60  # a round, at most
    growth: GrowthConfig | None = None  # set by `growth.growing` from Config.growth, where F grows into the solid
    usual_steps: tuple[int, ...] = (13, 21, 27, 7, 6, 6)  # of the rounds of most runs: tells the time left
    least_steps: int = 6  # a round: what unfolds a few spans hardly lowers the energy of the whole
    slides: int = 3  # of the boundary parameters after each step
    relaxations: int = 1  # sweeps over the triangles that these flipped
    last_slides: int = 20  # before the boundary map is made, and again after `last_sweeps`
    last_sweeps: int = 600  # over the triangles that the last slides flipped, at most
    first_gain: float = 8e-3  # share of the energy: where steps with sliding lower it by less, the first round ends
    gain: float = 1e-3  # likewise the later ones
    small_gains: int = 2  # of these in a row: a step may gain little by chance
    memory: int = 4  # differences of Newton steps from which the next place is guessed
    damping: float = 1.0  # of a Newton step once the one before had to be shortened (Levenberg, Marquardt)
    damping_growth: float = 3.0  # factor after each further one, and divisor after a full step
    tolerance: float = 0.1  # of the inner solves, relative
    iterations: int = 20  # of an inner solve, at most
    pull: float = 3e-4  # share of `vertex` in the preconditioner: more would hold back what slides along the surface

    @property
    def longest_edge(self) -> float:
        """Return the length at volume 1 above which the mesh's edges are cut: a span of the cube."""
        return 1.0 / (self.control_points - self.degree)


@dataclass(frozen=True)
class RefinementConfig:
    """When knots are inserted after the spline stage, where, and how the map is optimised then.

    tolerance: of the root mean square distance between the surface and the spline's boundary, taken both ways, over the
    diagonal of the surface's bounding box.
    max_control_points: a direction.
    """

    tolerance: float = 5e-4
    max_control_points: int = 60
    share: float = 0.7  # of the squared distances lies on the spans that are halved together
    growth: float = 2.0  # factor of the number of control points in one refinement, at most
    distortion: float = 0.25  # what the distortion above its limit counts, all squared distances together counting 1
    narrowest: float = 0.2  # of the first spline's spans: none gets narrower than this share of their length
    vertex: float = 3.0  # factor of the spline stage's `vertex`: the boundary counts more once the map is in shape
    gain: float = 3e-4  # in place of the spline stage's
    rounds: int = 8  # after a refinement, at most
    polish: int = 3  # of them, while the map is certified, at most


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
    growth : GrowthConfig
    stiff_growth : GrowthConfig
        Of the second growth.
    last_growth : GrowthConfig
        Of the last one.
    extension : ExtensionConfig
    refinement : RefinementConfig or None
        Where knots are inserted after the spline stage; None: the control points of `spline` are all there are.
    starts : int
        The tries in all, at most 5: where a shape is hard to train, or the trained map is not certified, one is grown.
        Where that is not certified or meets itself, a layout is extended and a stiffer map grown; in the end one that
        may be farther from the surface.

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
    growth: GrowthConfig = GrowthConfig()
    stiff_growth: GrowthConfig = STIFF
    last_growth: GrowthConfig = LAST
    extension: ExtensionConfig = ExtensionConfig()
    starts: int = 5
    refinement: RefinementConfig | None = None

    def scaled(self, factor: float) -> Config:
        """Return the same options with `factor` (at most 100) times as many steps in every stage, at least one each.

        With fewer steps every shape looks hard: with a factor below 1 those that "fast" trains are trained to the end.
        """
        if not isinstance(factor, Real) or not 0.0 < factor <= 100.0:
            raise ValueError(f"steps factor must be a positive number, at most 100, got {factor!r:.80}")
        stages = tuple(replace(s, steps=max(1, round(factor * s.steps))) for s in self.stages)
        spline = replace(self.spline, steps=max(1, round(factor * self.spline.steps)))
        train = self.train if factor >= 1.0 or not self.train.easy_loss else replace(self.train, easy_loss=None)
        growths = (self.growth, self.stiff_growth, self.last_growth)
        growth, stiff, last = (replace(g, steps=max(1, round(factor * g.steps))) for g in growths)
        return replace(
            self, train=train, stages=stages, spline=spline, growth=growth, stiff_growth=stiff, last_growth=last
        )

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


def _stages(*steps: int) -> tuple[StageConfig, ...]:
    """Return the five stages with these numbers of steps."""
    return tuple(map(StageConfig, get_args(StageName), steps))


_FAST = Config("fast", NetworkConfig(scale=3.14), TrainConfig(), _stages(90, 60, 90, 30, 60), SplineConfig())
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
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"unknown preset {name!r}: choose one of {', '.join(PRESETS)}")
    return PRESETS[name]
