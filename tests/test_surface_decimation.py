from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np
import pytest

from iga_nn.cli.commands import main
from iga_nn.samples import sample, write_obj
from parameterize.surface.decimation import decimate
from parameterize.surface.surface import MeshError


def test_a_small_surface_is_left_alone():
    bean = sample("bean")
    assert decimate(bean, len(bean.faces)) is bean


def test_a_large_surface_keeps_its_shape_and_says_how_far_it_moved():
    bean = sample("bean")
    smaller = decimate(bean, 1200)
    assert len(smaller.faces) <= 1200 and len(smaller.crossings) == 0
    assert smaller.volume == pytest.approx(bean.volume, rel=0.01)
    assert smaller.name == "bean" and smaller.sha256 != bean.sha256
    moved = igl.hausdorff(np.asfortranarray(bean.vertices), bean.faces, smaller.vertices, smaller.faces)
    (notice,) = smaller.notices
    assert notice == f"decimated from 4996 to {len(smaller.faces)} faces: moved by at most {moved:.3g} at vertices"
    assert 0.0 < moved < 0.02


def test_notices_and_the_file_stay_and_lengths_are_the_users():
    bean = sample("bean")
    thousand = replace(bean, vertices=1000.0 * bean.vertices, scale=bean.scale / 1000.0, center=1000.0 * bean.center)
    smaller = decimate(replace(thousand, source="bean.obj", notices=("mended",)), 1200)
    assert smaller.source == "bean.obj" and smaller.notices[0] == "mended"
    moved = float(smaller.notices[1].rsplit(" ", 3)[1])
    assert moved == pytest.approx(1000.0 * float(decimate(bean, 1200).notices[0].rsplit(" ", 3)[1]), rel=0.02)


def test_too_few_faces_are_refused():
    with pytest.raises(MeshError, match="max_faces must be a whole number, at least 4"):
        decimate(sample("bean"), 3)


def test_check_decimates_only_when_asked(in_folder, capsys):
    write_obj(sample("bean"), in_folder / "bean.obj")
    assert main(["check", "bean.obj", "--max-faces", "1000"]) == 2
    assert "raise --max-faces, or bring them down with --decimate" in capsys.readouterr().err
    assert main(["check", "bean.obj", "--max-faces", "1000", "--decimate"]) == 0
    assert "decimated from 4996 to 1000 faces" in capsys.readouterr().out


def test_a_run_with_decimation_says_so(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "bean", "--max-faces", "1000", "--decimate", "--out", "out"]) == 0
    from iga_nn.report import document as report

    found = report.read(in_folder / "out")
    assert found["input"]["faces"] == 1000 and found["command"].endswith("--max-faces 1000 --decimate --out out")
    assert "decimated from 4996 to 1000 faces" in capsys.readouterr().err
