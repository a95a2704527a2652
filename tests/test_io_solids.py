"""The solids of a body in files of other programs and in views: numbers of cells, attributes, colours and a legend."""

import numpy as np
from two_blocks import two_of_hexahedra, two_patches

import iga_nn
from iga_nn.figures.colors import color_labels, face_colors
from iga_nn.io.mfem_writer import write_mfem
from iga_nn.report.viewer import scene_of


def test_cells_have_the_number_of_their_solid():
    body = two_of_hexahedra(1)
    for grid in (body.to_pyvista(), body.to_pyvista(samples=1)):
        centres = grid.cell_centers().points[:, 0]
        assert np.array_equal(grid.cell_data["solid"], (centres > 1.0).astype(int))
    plain = iga_nn.Body(body.patches, body.interfaces)
    assert "solid" not in plain.to_pyvista().cell_data


def test_elements_of_mfem_have_the_attribute_of_their_solid(tmp_path):
    body = two_of_hexahedra(1)
    for name, given in (("solids", body), ("plain", iga_nn.Body(body.patches, body.interfaces))):
        write_mfem(tmp_path / name, given)
    attributes = {name: _elements((tmp_path / name).read_text()) for name in ("solids", "plain")}
    assert attributes["solids"] == (body.solids.numbers + 1).tolist()
    assert attributes["plain"] == list(range(1, 49))


def _elements(text):
    lines = text.split("elements\n")[1].split("\n")
    return [int(line.split()[0]) for line in lines[1 : 1 + int(lines[0])]]


def test_patches_have_the_colour_of_their_solid():
    body = two_of_hexahedra(1)
    colors = np.reshape(face_colors(body), (len(body), 6))
    assert [name for _, name in color_labels(body)] == ["steel", "pad"]
    for number, (color, _) in enumerate(color_labels(body)):
        assert set(colors[body.solids.numbers == number].ravel()) == {color}


def test_the_view_names_the_solid_of_a_place():
    scene = scene_of(two_patches())
    assert scene["solids"] == [0, 1] and scene["solid_names"] == ("steel", "pad")
    assert [name for _, name in scene["legend"]] == ["steel", "pad"]
