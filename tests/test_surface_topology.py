"""Faces that pass through each other, on meshes where one knows which."""

import json

import numpy as np
import pytest
import trimesh

from iga_nn.cli.commands import BAD_INPUT, DONE, main
from iga_nn.samples import sample, write_obj
from parameterize.surface.surface import MeshError, surface_from_arrays
from parameterize.surface.topology import crossing_faces, crossing_places


def dented(depth):
    """A ball of radius 1 with one vertex pushed along the diameter below it: through the other side for depth > 2."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = np.array(ball.vertices)
    vertices[np.argmax(vertices[:, 2]), 2] -= depth
    return vertices, np.asarray(ball.faces)


def test_a_spike_through_the_far_side_is_found_with_its_place():
    vertices, faces = dented(2.5)
    top = np.argmax(trimesh.creation.icosphere(subdivisions=3).vertices[:, 2])
    pairs = crossing_faces(vertices, faces)
    assert len(pairs) >= 5  # each face of the spike passes through the bottom
    assert np.all(np.any(faces[pairs] == top, axis=2).sum(axis=1) == 1)  # one of each pair is the spike's
    assert crossing_places(vertices, faces, pairs) == pytest.approx(np.tile([0, 0, -1], (len(pairs), 1)), abs=0.15)
    assert len(crossing_faces(*dented(1.9))) == 0


def test_faces_with_a_common_vertex():
    vertices = np.array([[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1.2, 0, 1]], dtype=float)
    assert crossing_faces(vertices, np.array([[0, 1, 2], [0, 3, 4]])).tolist() == [[0, 1]]
    vertices[3:, 1] += 5.0
    assert len(crossing_faces(vertices, np.array([[0, 1, 2], [0, 3, 4]]))) == 0


@pytest.mark.parametrize("name", ["bean", "cube", "seashell"])
def test_the_samples_do_not_intersect_themselves(name):
    assert len(sample(name).crossings) == 0


def test_a_notice_in_user_units_and_a_refusal_on_demand():
    vertices, faces = dented(2.5)
    surface = surface_from_arrays(1000.0 * vertices + [7000.0, 0.0, 0.0], faces, "spike")
    (notice,) = [line for line in surface.notices if "self-intersection" in line]
    assert f"{len(surface.crossings)} pairs of faces" in notice and "near (69" in notice
    first = surface.summary()["self_intersections"]["first"]
    assert len(first) == 5 and first[0]["faces"] == surface.crossings[0].tolist()
    with pytest.raises(MeshError, match="spike: self-intersection: .* pairs of faces.*--strict"):
        surface.refuse_crossings()


def test_check_warns_and_strict_refuses(tmp_path, capsys):
    path = tmp_path / "spike.obj"
    write_obj(surface_from_arrays(*dented(2.5), "spike"), path)
    assert main(["check", str(path), "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["self_intersections"]["pairs"] >= 5
    assert main(["check", str(path), "--strict"]) == BAD_INPUT
    error = capsys.readouterr().err
    assert "self-intersection" in error and len(error.splitlines()) == 1
    assert main(["check", "cube", "--strict"]) == DONE
