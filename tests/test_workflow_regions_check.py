"""What regions are on a box of sides 1, 2 and 3 with two triangles a side: areas and counts known by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, obj

from iga_nn.cli.commands import main
from iga_nn.workflow.regions import cover, facts_of, placed_on, share_of
from parameterize.surface.surface import surface_from_arrays

SIDES = [1.0, 2.0, 3.0]
AREA = 22.0


@pytest.fixture(scope="module")
def box():
    return surface_from_arrays(CUBE * SIDES, TRIANGLES)


@pytest.mark.parametrize(
    ("text", "area", "triangles"),
    [("nz > 0.9", 2.0, 2), ("face(1, 1, 1)", 6.0, 2), ("nx > 0.9 or ny > 0.9", 9.0, 4), ("x > -1", AREA, 12)],
)
def test_a_region_of_whole_triangles_has_their_area_exactly(box, text, area, triangles):
    (region,) = placed_on([text], box)
    found = facts_of(region, box)
    assert found == {
        "region": text,
        "area": pytest.approx(area, rel=1e-14),
        "share": pytest.approx(area / AREA, rel=1e-14),
        "triangles": triangles,
    }


def test_a_region_that_ends_within_triangles_has_its_share_of_each(box):
    (region,) = placed_on(["nz > 0.9 and x < 0.25"], box)
    assert facts_of(region, box)["area"] == pytest.approx(0.5, rel=0.05)
    shares = cover(region, box)
    assert np.sort(shares)[:10].max() == 0.0
    np.testing.assert_allclose(np.sort(shares)[10:], [1 / 16, 7 / 16], atol=0.03)  # of triangles cut at 1/4
    assert share_of(region, box) == pytest.approx(0.5 / AREA, rel=0.1)


def test_scaled_coordinates_are_those_of_volume_1_about_the_middle(box):
    inside, outside = placed_on(["nx > 0.9 and Y < 0", "Z > 0.83"], box)  # 6^(1/3) = 1.817, and 1.5 of it is 0.8255
    assert facts_of(inside, box)["area"] == pytest.approx(3.0, rel=0.05)
    with pytest.raises(ValueError, match=r"no point of the surface lies there; .* z from 0 to 3"):
        facts_of(outside, box)


def test_check_tells_regions_and_draws_them(in_folder, capsys, monkeypatch):
    drawn = []
    monkeypatch.setattr("iga_nn.figures.render.can_draw", lambda: True)
    monkeypatch.setattr("iga_nn.figures.regions.draw_regions", lambda path, *given: drawn.append((path, *given)))
    Path("box.obj").write_text(obj(CUBE * SIDES, TRIANGLES))
    regions = ["--region", "nz > 0.9", "--region", "face(1, 1, 1)"]
    assert main(["check", "box.obj", *regions, "--picture", "regions.png"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[1:3] == [
        "region:          nz > 0.9, area 2, 9.09% of the surface, 2 triangles",
        "region:          face(1, 1, 1), area 6, 27.27% of the surface, 2 triangles",
    ]
    (found,) = drawn
    assert str(found[0]) == "regions.png" and list(map(str, found[2])) == ["nz > 0.9", "face(1, 1, 1)"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--region", "nz > 2"], "region 'nz > 2': no point of the surface lies there; x runs from 0 to 1"),
        (["--region", "u0"], "region 'u0': has faces of the cube, which are known once the part is mapped"),
        (["--region", "nz >"], "region 'nz >'"),
        (["--region", "group:inlet"], "group 'inlet' does not exist"),
        (["--picture", "regions.jpg"], "such files end in .png: choose another name with --picture"),
        (["--picture", "there.png"], "there.png: exists; --force replaces it"),
    ],
)
def test_a_region_or_a_picture_that_is_refused_is_one_line(in_folder, capsys, options, says):
    Path("box.obj").write_text(obj(CUBE * SIDES, TRIANGLES))
    Path("there.png").write_bytes(b"a picture")
    assert main(["check", "box.obj", *options]) == 2
    said = capsys.readouterr()
    assert says in said.err and said.err.count("\n") == 1 and said.out == ""
    assert Path("there.png").read_bytes() == b"a picture"
