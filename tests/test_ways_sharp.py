"""Maps whose cube has its edges on the sharp edges of the surface."""

import numpy as np
import pytest
from shapes import rounded_cube
from test_cube_constrained import drum

from parameterize.config import preset
from parameterize.progress import History, ignore
from parameterize.run import parameterize
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.sharp import SHARP, ridges_of

QUICK = preset("fast").scaled(0.1).with_control_points(7).with_blocks(1)


def test_the_rims_of_a_drum_are_edges_of_the_cube():
    vertices, faces = drum(72)  # sides: without the limit of one block it would be a stack
    result = parameterize(surface_from_arrays(vertices, faces, "drum"), QUICK)
    kept = result.quality.sharpness
    assert [one.start for one in result.attempts] == ["sharp edges"] and result.origin == "sharp"
    assert result.certificate.verdict == "certified"
    assert kept.edges == 2 and kept.distance.rms < 5e-3
    on = np.flatnonzero(np.isin(vertices[:, 2], (0.0, 1.0)) & (np.arange(len(vertices)) < 144))
    at_edges = np.isin(result.boundary.parameters[on], (0.0, 1.0)).sum(axis=1) >= 2
    assert at_edges.mean() > 0.9  # the last triangles that are turned back may take a point along


def test_a_smooth_surface_has_too_few_ridges():
    surface = surface_from_arrays(*rounded_cube(400, 2.0), "ball")
    task = MappingTask(surface, QUICK, 0, "cpu", "float32", None, {}, {"history": History(), "progress": ignore})
    assert ridges_of(task) is None and not SHARP.suits(task).applies


@pytest.mark.slow
def test_corners_of_the_users_are_kept():
    vertices, faces = drum(80)
    surface = surface_from_arrays(vertices, faces, "drum")
    at = {(1, 1): 0, (0, 1): 20, (0, 0): 40, (1, 0): 60}
    corners = [80 * w + at[u, v] for u in (0, 1) for v in (0, 1) for w in (0, 1)]
    result = parameterize(surface, QUICK, corners=corners)
    ends = result.volume.grid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]).reshape(-1, 3)
    assert np.linalg.norm(ends - vertices[corners], axis=1).max() < 0.05
    assert result.attempts[0].start == SHARP.name
    assert result.quality.sharpness.distance.rms < 5e-3
