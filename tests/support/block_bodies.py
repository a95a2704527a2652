"""Small bodies of blocks whose blocks are turned, so that their interfaces are swapped and flipped in all ways."""

from itertools import permutations, product

import numpy as np

from parameterize.layouts.complex import Complex, spline_of
from parameterize.optimization.reassignment import reassign
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import TANGENTIAL, Correspondence
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.spline.spline_map import ControlNets
from parameterize.surface.geometry import vertex_quadrics, vertex_weights

TURNS = [
    (axes, signs)
    for axes, signs in product(permutations(range(3)), product((1, -1), repeat=3))
    if np.linalg.det(np.eye(3)[list(axes)]) * np.prod(signs) > 0
]  # the 24 rotations of a cube


def uniform_nets(*spans, interfaces=(), degree=3):
    """Nets of blocks with so many spans (n_u, n_v, n_w) each, on uniform knots."""
    knots = tuple(tuple(open_uniform_knots(degree + n, degree) for n in each) for each in spans)
    return ControlNets(degree, knots, tuple(interfaces))


def glued(*blocks):
    """Blocks by name, corners [u][v] of sections (m, 2, 2, 3) along w, and spans, glued where corners are equal."""
    numbers, sections = {}, {}
    for name, corners, _ in blocks:
        rows = np.reshape(corners, (-1, 3))
        own = [numbers.setdefault((row + 0.0).tobytes(), len(numbers)) for row in rows]
        sections[name if name not in sections else f"{name}, {len(sections)}"] = np.moveaxis(
            np.reshape(own, (len(corners), 2, 2)), 0, -1
        )
    points = np.array([np.frombuffer(row) for row in numbers])
    return Complex.of(points, sections, [spans for *_, spans in blocks])


def map_of(blocks):
    """The map of degree 3 with control points in blocks, and equal to these where they are straight."""
    return spline_of(blocks, 3)


def wavy(spline, amplitude, seed=0):
    """The same blocks with control points moved at random, those of interfaces together."""
    moves = np.random.default_rng(seed).uniform(-amplitude, amplitude, spline.control.shape)
    return spline.with_control(spline.control + spline.nets.merged(moves))


def surface_fit(spline, points, faces):
    """A surface whose points have the nearest places on the map's boundary that face the same way."""
    face = int(np.flatnonzero(spline.nets.exposed)[0])
    parameters = np.full((len(points), 3), 0.5)
    parameters[:, face % 6 // 2] = face % 2
    places = SlidingParameters(spline.nets, parameters, np.full(len(points), face), faces)
    quadrics = vertex_quadrics(points, faces, TANGENTIAL)
    fit = Correspondence(places, points, quadrics, vertex_weights(points, faces, len(points)))
    reassign(fit, spline.control, first=True)
    return fit


def sampled(spline, count=7):
    """Points (k, 3) on the map's boundary, their parameters and faces, and the triangles between them."""
    return SampledBoundary.on(spline.body, *[np.linspace(0.0, 1.0, count)] * 3)


def straight_block(corners, turn=0, spans=3):
    """The block over corners [u][v][w], (2, 2, 2, 3), with its directions turned by one of 24 rotations."""
    axes, signs = TURNS[turn % len(TURNS)]
    turned = np.asarray(corners, dtype=float).transpose(*axes, 3)[tuple(slice(None, None, s) for s in signs)]
    return f"turn {turn}", np.moveaxis(turned, 2, 0), (spans,) * 3


def box(low, high):
    """The corners [u][v][w] of a box."""
    return np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)


def rod(turn=0, lengths=(1.0, 2.0), spans=3):
    """Boxes one after the other along x, 0.5 wide and 0.8 high, all but the first turned."""
    ends = np.cumsum([0.0, *lengths])
    pairs = enumerate(zip(ends[:-1], ends[1:], strict=True))
    boxes = [straight_block(box((a, 0.0, 0.0), (b, 0.5, 0.8)), k * turn, spans) for k, (a, b) in pairs]
    return map_of(glued(*boxes))


def fan(count, turn=0, spans=3, angle=300.0):
    """Kites of height 2 side by side around an edge, where an angle is left open; each is turned differently."""
    blocks, step = [], np.radians(angle) / count
    rays = [[np.cos(k * step), np.sin(k * step)] for k in range(count + 1)]
    for k, (ray, following) in enumerate(zip(rays[:-1], rays[1:], strict=True)):
        middle = np.array([np.cos((k + 0.5) * step), np.sin((k + 0.5) * step)]) * 1.3
        plane = np.array([[[0.0, 0.0], following], [ray, middle]])  # [u][v]
        corners = np.stack([np.concatenate([plane, np.full((2, 2, 1), z)], axis=-1) for z in (0.0, 2.0)], axis=2)
        blocks.append(straight_block(corners, k * turn, spans))
    return map_of(glued(*blocks))


def ring(turn=0, count=5, spans=3):
    """Straight blocks around a hole."""
    blocks = []
    for k in range(count):
        angles = 2.0 * np.pi * np.array([k, (k + 1) % count]) / count
        corners = [[[[r * np.cos(a), r * np.sin(a), z] for z in (0.0, 0.6)] for a in angles] for r in (0.7, 1.4)]
        blocks.append(straight_block(corners, k * turn, spans))
    return map_of(glued(*blocks))


BODIES = {
    "rod": rod,
    "ring": ring,
    "three blocks around an edge": lambda turn=0: fan(3, turn, angle=270.0),
    "four blocks around an edge": lambda turn=0: fan(4, turn),
}
