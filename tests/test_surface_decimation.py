from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np
import pytest

from iga_nn.cli.commands import main
from iga_nn.samples import sample, write_obj
from parameterize.surface import decimation
from parameterize.surface.decimation import decimate
from parameterize.surface.surface import MeshError, surface_from_arrays


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


def bent_plate(cells, thickness):
    """Return a wavy plate over the unit square, its triangles as two sheets and a rim."""
    row = np.linspace(0.0, 1.0, cells + 1)
    x, y = np.meshgrid(row, row, indexing="ij")
    low = np.stack([x, y, 0.05 * np.sin(7.0 * x) * np.cos(5.0 * y)], axis=-1)
    numbers = np.arange(low.size // 3).reshape(low.shape[:2])
    a, b, c, d = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    upper = np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in ((a, b, c), (a, c, d))])
    ring = np.concatenate([numbers[:-1, 0], numbers[-1, :-1], numbers[:0:-1, -1], numbers[0, :0:-1]])
    after, below = np.roll(ring, -1), numbers.size
    rim = np.concatenate(
        [np.stack([ring, ring + below, after + below], axis=-1), np.stack([ring, after + below, after], axis=-1)]
    )
    points = np.concatenate([low + [0.0, 0.0, thickness], low]).reshape(-1, 3)
    return surface_from_arrays(points, np.concatenate([upper, upper[:, ::-1] + below, rim]), "plate")


def test_a_thin_body_that_a_copy_would_make_another_one_is_fitted_whole(monkeypatch):
    monkeypatch.setattr(decimation, "MOST_FITTED", 1000)
    monkeypatch.setattr(decimation, "FITTED", 600)
    thick, thin = bent_plate(30, 0.05), bent_plate(30, 1e-4)
    copy, said = decimation.fitted_copy(thick)
    assert copy.volume == pytest.approx(thick.volume, rel=0.01) and said.startswith("laid out and fitted on a copy")
    same, said = decimation.fitted_copy(thin)
    assert same is thin and "the volume of a copy is" in said
    assert any("than the input's: raise --max-faces" in notice for notice in decimate(thin, 600).notices)
