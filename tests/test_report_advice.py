from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import formula_parameterization
from example_files import shown
from volumes import bent, mapped

from iga_nn.cli.commands import main
from iga_nn.options import MapOptions
from iga_nn.report import advice
from iga_nn.report import document as report
from iga_nn.workflow.output_folder import RunFolder
from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from solve.study import benchmark_volume


def folded_at_one_end():
    """x is about 10 (u - 1/4)^2: det J < 0 where u < 1/4, and nowhere else."""
    return mapped(lambda u, v, w: (10.0 * (u**2 - 0.5 * u), 2.0 * v, 3.0 * w), shape=(16, 4, 4), degrees=(2, 2, 2))


def failed(**given):
    """A report of a map that is not certified."""
    return {"parameterization": {"bijective": "undecided", "control_points": [30, 30, 30], **given}}


def test_places_lie_in_the_folded_part_in_the_volumes_units():
    volume = folded_at_one_end()
    certificate = certify(volume)
    assert certificate.verdict == "folded"
    found = advice.unproved(volume, certificate)["unproved"]
    assert found["spans"] == len(certificate.unproved) > 5
    assert 0 < len(found["places"]) <= 5
    parameters = np.array(found["parameters"])
    assert parameters[:, 0].max() < 0.3 and tuple(parameters[0]) == certificate.witness
    np.testing.assert_allclose(found["places"], volume(parameters))
    places = advice.span_places(volume, certificate.unproved)
    assert len(places) == found["spans"] and np.all(places[:, 1] <= 2.0) and np.all(places[:, 2] <= 3.0)
    json.dumps(found)


def test_a_certified_map_has_neither_places_nor_advice():
    volume = benchmark_volume(4)
    certificate = certify(volume)
    assert advice.unproved(volume, certificate) == {}
    assert len(advice.span_places(volume, certificate.unproved)) == 0
    good = {"parameterization": {"bijective": "certified", "boundary_injective": True}}
    assert advice.what_to_try(good) == [] and advice.in_words(good) == []


@pytest.mark.parametrize(
    ("options", "wanted", "absent"),
    [
        (MapOptions(), ("--control-points 40", "--corners FILE", "--seed 1"), "--steps-factor"),
        (MapOptions(steps_factor=0.1, seed=4), ("leave out --steps-factor", "--seed 5"), "other corners"),
        (MapOptions(corners=Path("mine.json")), ("other corners",), "your own corners"),
        (None, ("--control-points 40", "--seed 1"), "--steps-factor"),
    ],
)
def test_advice_names_what_was_not_tried(options, wanted, absent):
    text = "\n".join(advice.what_to_try(failed(), options))
    assert all(word in text for word in wanted) and absent not in text


def test_advice_knows_the_most_control_points_and_an_overlap():
    assert "--control-points" not in "\n".join(advice.what_to_try(failed(control_points=[100, 100, 100])))
    overlapping = failed(bijective="certified", boundary_injective=False, boundary_meeting={"point": [1.0, 2.0, 3.0]})
    assert "are farther apart" in advice.what_to_try(overlapping)[0]
    assert advice.in_words(overlapping)[0].endswith("(1, 2, 3)")


def test_of_blocks_the_limit_of_auto_is_raised():
    blocks = failed(patches=[{}, {}], control_points=2916)
    assert advice.what_to_try(blocks, MapOptions()) == ["more control points: --control-points 40"]
    assert advice.what_to_try(blocks, MapOptions(control_points="auto")) == [
        "more control points: --max-control-points 70"
    ]


def test_a_surface_that_crosses_itself_is_the_first_suspect():
    crossing = failed() | {"input": {"self_intersections": {"pairs": 7}}}
    assert ": 7 pairs of its faces do" in advice.what_to_try(crossing)[0]


@pytest.mark.pictures
def test_a_folded_run_ends_with_places_advice_and_a_picture(formula_training, in_folder, capsys):
    formula_training(amplitude=0.38)
    assert main(["parameterize", "cube", "--out", "out"]) == 3
    out = capsys.readouterr().out
    assert "not proved       on " in out and "try              more control points" in out
    found = report.read(in_folder / "out")
    assert found["parameterization"]["unproved"]["spans"] > 0 and len(found["advice"]) == 3
    assert shown_in_grey(in_folder / "out" / "folds.png") and shown(in_folder / "out" / "meeting.png")
    text = (in_folder / "out" / "report.html").read_text()
    assert "what to try" in text and "more control points: --control-points" in text
    assert main(["check", "out/volume.npz"]) == 3
    assert "unproved:" in capsys.readouterr().out


def test_json_has_places_and_advice(formula_training, in_folder, capsys):
    formula_training(amplitude=0.38)
    assert main(["parameterize", "cube", "--out", "out", "--json", "--quiet"]) == 3
    verdict = json.loads(capsys.readouterr().out)
    assert verdict["unproved"]["places"] and any("--seed" in line for line in verdict["advice"])


def test_the_pictures_of_an_older_run_go(formula_training, in_folder):
    (in_folder / "out").mkdir()
    (in_folder / "out" / "meeting.png").touch()
    report.write(in_folder / "out", {"schema": report.SCHEMA})  # of a run that has not ended
    formula_training()
    assert main(["parameterize", "cube", "--out", "out"]) == 0
    assert not (in_folder / "out" / "meeting.png").exists() and not (in_folder / "out" / "folds.png").exists()


def test_where_the_boundary_meets_itself_there_is_a_picture(tmp_path, small_views):
    volume = bent(1.3)
    RunFolder(tmp_path).draw("map", faulty=volume, meeting=check_boundary(volume).meeting)
    assert shown(tmp_path / "meeting.png") and not (tmp_path / "folds.png").exists()


def test_folds_are_drawn_with_their_number(tmp_path, small_views):
    volume = folded_at_one_end()
    places = advice.span_places(volume, certify(volume).unproved)
    RunFolder(tmp_path).draw("map", faulty=volume, places=places)
    assert shown_in_grey(tmp_path / "folds.png")


def shown_in_grey(picture):
    """Whether there are many grey and some black points, or nothing can be drawn here."""
    from matplotlib.image import imread

    from iga_nn.figures.render import can_draw

    if not can_draw():
        return not picture.exists()
    grey = imread(picture)[..., :3].mean(axis=-1)
    return np.mean((grey > 0.4) & (grey < 0.97)) > 0.05 and np.mean(grey < 0.1) > 1e-4


def test_the_page_of_a_certified_map_gives_no_advice():
    good = {"parameterization": formula_parameterization().quality.as_dict()}
    assert advice.in_words(good) == []


SHEET = {"file": "sheet.step", "thickness": 0.96, "bbox": [[0, 0, 0], [60, 40, 25]], "unit": "mm"}
ONE_CUBE = {"attempts": [{"origin": "network"}]}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (MapOptions(ways=("network",)), "leave out --ways, or add hexahedra to it"),
        (MapOptions(blocks=1), "leave out --blocks"),
        (MapOptions(corners=Path("mine.json")), "leave out --corners"),
    ],
)
def test_a_thin_part_is_told_of_hexahedra_and_of_nothing_else(options, said):
    thin = failed(**ONE_CUBE) | {"input": SHEET}
    assert advice.what_to_try(thin, options) == [f"a part of 0.96 mm in 60: hexahedra, which serve every part: {said}"]
    smooth = failed(**ONE_CUBE) | {"input": {"file": "duck.obj", "sharp_edges": {"length": 0.0}}}
    assert "hexahedra" not in "\n".join(advice.what_to_try(smooth, options))


def test_what_the_mesher_says_and_a_time_limit_are_reasons():
    refused = failed(**ONE_CUBE, refused={"hexahedra": "Netgen takes more than 120 s"}) | {"input": {}}
    (said,) = advice.what_to_try(refused, MapOptions())
    assert said.startswith("hexahedra could not be made (Netgen takes more than 120 s): repair the surface")
    assert advice.what_to_try(failed() | {"cut_map": "the rounds"}, MapOptions()) == [
        "more time: --resume goes on, with a longer --time-limit or none"
    ]
