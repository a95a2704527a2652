"""Volumes by formula for the tests."""

from dataclasses import replace

import numpy as np

from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Poisson
from solve.discretization.operator import assemble
from solve.discretization.space import trial_space


def mapped(function, shape=(6, 6, 6), degrees=(3, 3, 3)):
    """The volume whose control points are `function` at the Greville points."""
    knots = tuple(open_uniform_knots(n, p) for n, p in zip(shape, degrees, strict=True))
    rows = [greville(k, p) for k, p in zip(knots, degrees, strict=True)]
    u, v, w = np.meshgrid(*rows, indexing="ij")
    return BSplineVolume(degrees, knots, np.stack(function(u, v, w), axis=-1))


def bent(turns, rise=0.0, shape=(24, 4, 4)):
    """A bar of 0.6 x 0.6 around a circle of radius 1; `rise`: the climb over its whole length."""

    def place(u, v, w):
        angle, radius = 2.0 * np.pi * turns * u, 1.0 + 0.6 * (v - 0.5)
        return radius * np.sin(angle), radius * np.cos(angle), 0.6 * (w - 0.5) + rise * u

    return mapped(place, shape)


def scalar_system(volume, space=None, source=None, rule=None, *, kappa=None, reaction=None, dirichlet=FACE_NAMES):
    """Operator and load of -div(kappa grad u) + c u = source on a space (default: the volume's own)."""
    space = replace(space or trial_space(volume), dirichlet=dirichlet)
    law = Poisson(source=source or (lambda x, y, z: 0.0 * x), kappa=kappa, reaction=reaction)
    return assemble(volume, space, law, law.source_at, rule)


def spans_at(volume, points):
    """Element of each point, counted with u fastest, and the coordinates in it."""
    numbers, local, step = np.zeros(len(points), dtype=int), np.empty_like(points), 1
    for axis, knots in enumerate(volume.knots):
        breaks = np.unique(knots)
        i = np.searchsorted(breaks, points[:, axis], side="right") - 1
        local[:, axis] = (points[:, axis] - breaks[i]) / (breaks[i + 1] - breaks[i])
        numbers += step * i
        step *= len(breaks) - 1
    return numbers, local
