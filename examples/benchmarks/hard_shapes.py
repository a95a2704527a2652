"""Random closed surfaces that are hard to fill, made by formula: equal numbers, equal shapes.

The first thousand numbers are surfaces of genus 0 that are hard to fill with one cube; from 1000 on there are bodies
with limbs, and thick graphs of genus 1 to 8. A unit ball is deformed, or parts are joined by their distance fields, and
the result is turned at random; its 1 500 to 3 000 triangles (4 000 to 8 000 of the later ones) are spread so that they
come out even, or evened out afterwards. Where the surface then intersects itself, or parts have grown together, the
same shape is made anew, milder.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from distance_fields import Array, Field, IntArray, Triangles, box, capsule, contour, evened, has_genus, joined
from processes import compute_measured
from random_bodies import graph, limbed
from scipy.spatial.transform import Rotation

from iga_nn.batch.task import Task
from iga_nn.samples import GOLDEN_ANGLE, ball, outward_hull, write_obj
from iga_nn.workflow.worker_run import Ended
from parameterize.surface.surface import MeshError, Surface, surface_from_arrays
from parameterize.surface.topology import crossing_faces

FINE = 10_000  # points of a ball whose triangles are evened out
FACES = (1500, 3000)
ROD_FACES = (4000, 8000)  # the same for rods: some ten around each
SEED = 2025
MILDER = 0.85  # of the severity, each time a shape is made anew
TRIES = 20
CELL = 0.02  # of the grid on which a distance field's surface is found
ROD_CELL = 0.04  # the same for rods, whose radius is .08 and more
LATER = 1000  # from here on the kinds of LATER_KINDS take turns; below, numbers keep their surfaces
GENERA = 8  # of the thick graphs: 1 to 8 take turns


def hard_shape(number: int) -> Surface:
    """Surface `number` (0, 1, ...): kinds take turns; named by number and kind."""
    return surface_from_arrays(*hard_triangles(number), name_of(number))


def hard_triangles(number: int) -> Triangles:
    """Vertices and faces of surface `number`, of the genus that it is to have and without crossings."""
    kind, genus, severity = kind_of(number), genus_of(number), 1.0
    for _ in range(TRIES):
        vertices, faces = _triangles(kind, np.random.default_rng([SEED, number]), severity, genus)
        if not len(crossing_faces(vertices, faces)) and has_genus(faces, genus):
            return vertices, faces
        severity *= MILDER
    raise MeshError(f"{name_of(number)}: intersects itself even after {TRIES} tries")


def compute_shape(task: Task, number: int, batch: str) -> Ended:
    """Make the surface that `task.mesh` names, NNN-kind.obj, where it is not there; then compute it, measured."""
    mesh = Path(task.mesh)
    try:
        if not mesh.is_file():
            write_obj(hard_shape(int(mesh.stem.partition("-")[0])), mesh)
    except MeshError as error:
        return Ended("refused", str(error))
    return compute_measured(task, number, batch)


def name_of(number: int) -> str:
    """Number and kind."""
    return f"{number:03d}-{kind_of(number)}"


def kind_of(number: int) -> str:
    """One of KINDS."""
    kinds = FIRST_KINDS if number < LATER else LATER_KINDS
    return kinds[number % len(kinds)]


def genus_of(number: int) -> int:
    """Handles of surface `number`."""
    return 1 + number // len(LATER_KINDS) % GENERA if kind_of(number) == "graph" else 0


def _triangles(kind: str, rng: np.random.Generator, severity: float, genus: int = 0) -> Triangles:
    """Vertices and faces, deformed and turned, of even edges."""
    count = int(rng.integers(*(ROD_FACES if kind in LATER_KINDS else FACES)))
    if kind in STRETCH:
        points, faces = _stretched_ball(count // 2 + 2, STRETCH[kind])
        vertices = SHAPES[kind](points, rng, severity)
    else:
        if kind in SOLIDS:
            fine, faces = contour(SOLIDS[kind](rng, severity), CELL)
        elif kind in LATER_KINDS:
            solid = graph(rng, severity, genus) if genus else limbed(rng, severity)
            fine, faces = contour(solid, ROD_CELL)
        else:
            points, faces = ball(FINE)
            fine = SHAPES[kind](points, rng, severity)
        vertices, faces = evened(fine, faces, count)
    return vertices @ Rotation.random(rng=rng).as_matrix(), faces


def _stretched_ball(count: int, stretch: float) -> tuple[Array, IntArray]:
    """Points (count, 3) of the unit ball and triangles that are even once the x axis is stretched by that factor."""
    axis = np.linspace(-1.0, 1.0, 2001)  # x along the axis
    element = np.sqrt(1.0 - axis**2 + (axis / stretch) ** 2)  # area of a ring of the spheroid, over d x
    area = np.concatenate([[0.0], np.cumsum(0.5 * (element[1:] + element[:-1]))])
    k = np.arange(count)
    x = np.interp((k + 0.5) / count, area / area[-1], axis)
    radius = np.sqrt(1.0 - x**2)
    points = np.stack([x, radius * np.cos(GOLDEN_ANGLE * k), radius * np.sin(GOLDEN_ANGLE * k)], axis=1)
    return points, outward_hull(points * [stretch, 1.0, 1.0])


# The kinds; severity 1 is the hardest


def bumpy(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A ball, slightly flattened, all bumps and hollows."""
    bumps = _field(rng, rng.uniform(3.0, 7.0))(points)
    axes = rng.uniform(0.7, 1.3, 3)
    return np.exp(severity * rng.uniform(0.2, 0.35) * bumps)[:, None] * points * axes


def bent(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A swelling sausage bent by 200 to 400 degrees, lifted like a spring so that its ends pass one another."""
    angle = severity * np.radians(rng.uniform(200.0, 400.0))
    width = rng.uniform(0.25, 0.45) * (1.0 + 0.2 * _field(rng, 2.0)(points))
    along = 0.5 * angle * points[:, 0]
    out = 1.0 + width * points[:, 1]
    lift = width * points[:, 2] * rng.uniform(0.7, 1.3) + rng.uniform(0.15, 0.35) * along
    return np.stack([out * np.sin(along), out * np.cos(along), lift], axis=1)


def spiky(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A ball with 4 to 10 spikes, up to four times as high as wide, the whole twisted."""
    count = int(rng.integers(4, 11))
    tips = ball(count)[0] @ Rotation.random(rng=rng).as_matrix()
    widths = rng.uniform(0.2, 0.4, count)  # radians
    heights = severity * widths * rng.uniform(2.5, 6.0, count)
    angles = np.arccos(np.clip(points @ tips.T, -1.0, 1.0))  # (n, count)
    radius = 0.7 + (heights * np.exp(-((angles / widths) ** 2))).sum(axis=1)
    grown = radius[:, None] * points
    return _twisted(grown, severity * rng.uniform(-0.5, 0.5))


def thin(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A sheet, 8 to 15 times as wide as thick, rolled up by 90 to 250 degrees and wavy."""
    sheet = _plate(points, 1.0 / rng.uniform(8.0, 15.0)) * [1.0, rng.uniform(0.6, 1.0), 1.0]
    angle = severity * np.radians(rng.uniform(90.0, 250.0))
    wave = severity * rng.uniform(0.03, 0.1) * _field(rng, 3.0)(sheet * [1.0, 1.0, 0.0])
    out = 2.0 / angle + sheet[:, 2] + wave
    along = 0.5 * angle * sheet[:, 0]
    return np.stack([out * np.sin(along), sheet[:, 1], out * np.cos(along)], axis=1)


def flat(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A plate with 2 to 6 arms, like a gingerbread man, 8 to 15 times as wide as thick."""
    plate = _plate(points, 1.0 / rng.uniform(8.0, 15.0))
    arms = int(rng.integers(2, 7))
    theta, rho = np.arctan2(plate[:, 1], plate[:, 0]), np.hypot(plate[:, 0], plate[:, 1])
    outline = rng.uniform(0.25, 0.55) * np.cos(arms * theta) + 0.2 * np.sin((arms - 1) * theta + rng.uniform(0.0, 6.0))
    grown = 1.0 + severity * outline * rho**2
    return plate * np.stack([grown, grown, np.ones_like(grown)], axis=1)


def long(points: Array, rng: np.random.Generator, severity: float) -> Array:
    """A worm 8 to 12 times as long as wide, with necks and bulges, in a gentle curve through space."""
    length = 1.0 + severity * rng.uniform(7.0, 11.0)
    along = points[:, 0]
    width = np.sqrt(1.0 + along**2) * np.exp(0.3 * severity * _field(rng, rng.uniform(5.0, 9.0))(points * [1, 0, 0]))
    phases, amplitudes = rng.uniform(0.0, 6.0, 2), severity * rng.uniform(0.5, 2.0, 2)
    curve = amplitudes * np.sin(2.0 * along[:, None] + phases)  # (n, 2)
    across = width[:, None] * points[:, 1:] * [1.0, rng.uniform(0.6, 1.0)]
    return np.concatenate([length * along[:, None], across + curve], axis=1)


def bulb(rng: np.random.Generator, severity: float) -> Field:
    """A ball on a stalk that is 6 to 12 times thinner, over a body of another size."""
    body, head = rng.uniform(0.6, 0.9), rng.uniform(0.4, 0.7)
    stalk, length = head / (1.0 + severity * rng.uniform(2.0, 5.0)), rng.uniform(0.5, 1.1)
    top = np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), body + length + head])
    ends = np.zeros(3), top
    return joined(0.06, capsule(ends[0], ends[0], body), capsule(*ends, stalk), capsule(ends[1], ends[1], head))


def fingers(rng: np.random.Generator, severity: float) -> Field:
    """A palm with 3 to 5 fingers side by side, the gaps between them down to a third of a finger's width."""
    count, radius = int(rng.integers(3, 6)), rng.uniform(0.13, 0.18)
    gap = radius * rng.uniform(0.7, 1.2) / severity
    places = (np.arange(count) - 0.5 * (count - 1)) * (2.0 * radius + gap)
    palm = box(np.zeros(3), np.array([places[-1] + 0.5 * radius, radius, rng.uniform(0.4, 0.7)]), 0.8 * radius)
    tips = rng.uniform(1.2, 1.9, count)
    lean = rng.uniform(-0.3, 0.3, count) * gap  # of the tips: no two touch
    parts = [
        capsule(np.array([x, 0.0, 0.2]), np.array([x + aside, rng.uniform(-0.1, 0.1), tip]), radius)
        for x, tip, aside in zip(places, tips, lean, strict=True)
    ]
    return joined(0.04, palm, *parts)


def flap(rng: np.random.Generator, severity: float) -> Field:
    """A body with one or two thin wings that lie along it, joined at one end, with a narrow gap."""
    body, length = rng.uniform(0.4, 0.6), rng.uniform(0.6, 1.0)
    thickness, gap = rng.uniform(0.06, 0.1), rng.uniform(0.1, 0.16) / severity
    parts = [capsule(np.array([0.0, 0.0, -length]), np.array([0.0, 0.0, length]), body)]
    for side in (-1.0, 1.0)[: int(rng.integers(1, 3))]:
        x = side * (body + gap + thickness)
        half = np.array([thickness, rng.uniform(0.25, 0.5), rng.uniform(0.7, 1.0) * length])
        parts.append(box(np.array([x, 0.0, -0.1]), half, 0.9 * thickness))
        root = np.array([x, 0.0, half[2] - 0.3])
        parts.append(capsule(root * [0.0, 1.0, 1.0], root, 0.2))
    return joined(0.03, *parts)


def folded(rng: np.random.Generator, severity: float) -> Field:
    """A thick sheet folded once or twice: its layers are close in space and far apart along the surface."""
    thickness, layers = rng.uniform(0.1, 0.16), int(rng.integers(2, 4))
    pitch = 2.0 * thickness + rng.uniform(0.7, 1.3) * thickness / severity
    length, width = rng.uniform(0.7, 1.1), rng.uniform(0.5, 0.9)
    bend = 0.5 * pitch * np.sin(np.linspace(0.0, np.pi, 9))
    rise = 0.5 * pitch * (1.0 - np.cos(np.linspace(0.0, np.pi, 9)))
    path = [np.array([[-length, 0.0]])]
    for layer in range(layers):
        side = 1.0 if layer % 2 == 0 else -1.0
        if layer < layers - 1:
            path.append(np.stack([side * (length + bend), layer * pitch + rise], axis=1))
        else:
            path.append(np.array([[side * length, layer * pitch]]))
    corners = np.concatenate(path)
    half = width - thickness
    ends = [np.insert(corners, 1, 0.0, axis=1)[i:] for i in (0, 1)]  # in the plane y = 0

    def distance(points: Array) -> Array:
        flattened = points * [1.0, 0.0, 1.0]
        across = np.maximum(np.abs(points[:, 1]) - half, 0.0)
        along = [capsule(a, b, 0.0)(flattened) for a, b in zip(ends[0], ends[1], strict=False)]
        return np.hypot(np.min(along, axis=0), across) - thickness

    return distance


Shape = Callable[[Array, np.random.Generator, float], Array]
SHAPES: dict[str, Shape] = {s.__name__: s for s in (bumpy, bent, spiky, thin, flat, long)}
SOLIDS = {s.__name__: s for s in (bulb, fingers, flap, folded)}
FIRST_KINDS = (*SHAPES, *SOLIDS)
LATER_KINDS = ("limbed", "graph")
KINDS = (*FIRST_KINDS, *LATER_KINDS)
STRETCH = {"bent": 5.0, "long": 10.0, "thin": 0.1, "flat": 0.1}  # about what a kind does to the ball's x axis


def _field(rng: np.random.Generator, frequency: float, waves: int = 12) -> Field:
    """A smooth random field around 0, of standard deviation near 1: waves of one length in all directions."""
    directions = rng.normal(size=(waves, 3))
    directions *= frequency / np.linalg.norm(directions, axis=1, keepdims=True)
    phases = rng.uniform(0.0, 2.0 * np.pi, waves)
    return lambda points: np.sqrt(2.0 / waves) * np.sin(points @ directions.T + phases).sum(axis=1)


def _plate(points: Array, thickness: float) -> Array:
    """The ball as a round plate of radius 1 across the z axis, flat with a round rim; thickness: in diameters."""
    rho = np.hypot(points[:, 1], points[:, 2])
    height = np.sign(points[:, 0]) * np.sqrt(np.clip(1.0 - rho**4, 0.0, 1.0))
    return np.stack([points[:, 1], points[:, 2], thickness * height], axis=1)


def _twisted(points: Array, rate: float) -> Array:
    """Turned about the z axis, by `rate` radians a unit of distance from it."""
    angle = rate * np.linalg.norm(points, axis=1)
    x, y = points[:, 0], points[:, 1]
    return np.stack(
        [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), points[:, 2]], axis=1
    )
