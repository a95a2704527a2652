"""The gallery shows the view of what an example has left, of one patch and of several."""

import sys
from types import SimpleNamespace

import pytest
from documents import ROOT

import iga_nn

sys.path.append(str(ROOT / "docs" / "_ext"))
from gallery_results import write_view  # noqa: E402 the path stands first


def cube(shift):
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + shift, v, w), control_points=4)


@pytest.mark.parametrize("body", [cube(0.0), iga_nn.Body.from_patches([cube(0.0), cube(1.0)])], ids=["one", "two"])
def test_a_view_shows_the_solution(tmp_path, body):
    left, pictures = tmp_path / "examples" / "out" / "box", tmp_path / "examples" / "pictures"
    left.mkdir(parents=True)
    pictures.mkdir()
    (pictures / "box.png").write_bytes(b"picture")
    body.save(left / "volume.npz")
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="x"), refine=0)
    app = SimpleNamespace(confdir=str(tmp_path / "docs"), outdir=str(tmp_path / "site"))
    assert write_view(app, "box") == "faces"
    solution.save(left / "solution.npz")
    assert write_view(app, "box") == "solution"
    assert "box" in (tmp_path / "site" / "scenes" / "box.html").read_text()
