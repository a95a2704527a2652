"""What is on the disk before a run is accepted, and after it was refused or interrupted: nothing of its own."""

from pathlib import Path

import pytest
from small_run import shortened

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.workflow.output_folder import open_folder
from parameterize.run import identity_of
from parameterize.spline.volume import BSplineVolume
from solve.study import benchmark_volume


@pytest.mark.parametrize(
    "arguments, says",
    [
        (
            ["run", "poisson", "beann"],
            "the samples are bean, bumpy_ball, cube, ellipsoid, seashell; did you mean bean?",
        ),
        (["run", "elasticity", "Cube", "--body-force", "0;0;-1"], "did you mean cube?"),
        (["run", "poisson", "zzz"], "zzz: no such file and no sample; the samples are bean,"),
        (["parameterize", "sea_shell", "--out", "new/er/out"], "did you mean seashell?"),
        (["parameterize", "conhc"], "did you mean conch?"),
        (["parameterize", "conch.obj"], "get it with `iga-nn fetch conch`"),
        (["check", "bean.obj"], "no such file; `iga-nn sample bean` writes it"),
        (["parameterize", "parts/bean.obj"], "parts/bean.obj: no such file: check the name and the folder"),
        (["batch", "beann", "ducc", "--out", "out"], "beann: no such file and no sample"),
        (["sample", "elipsoid"], "did you mean ellipsoid?"),
        (["fetch", "dukc"], "did you mean duck?"),
        (["export", "map.npz", "--to", "gismoo"], "did you mean gismo?"),
        (["solve", "poisson", "nothing.npz", "--out", "new/er/out"], "nothing.npz: no such file"),
        (["study", "nothing.npz"], "nothing.npz: no such file"),
        (["study", "map.npz", "--exact", "log(x-9)"], "not finite"),
        (["parameterize", "cube", "--corners", "nothing.json"], "nothing.json: cannot be read"),
        (["rnu", "poisson", "bean"], 'Did you mean "run"?'),
        (["run", "poison", "bean"], 'Did you mean "poisson"?'),
        (["run", "poisson", "bean", "--control-point", "9"], "Did you mean --control-points?"),
    ],
)
def test_what_is_refused_leaves_nothing_and_says_what_is_near(arguments, says, in_folder, capsys, monkeypatch):
    monkeypatch.delenv("IGA_NN_DATA", raising=False)
    benchmark_volume(2).save("map.npz")
    assert main(arguments) == 2
    line = capsys.readouterr().err.strip()
    assert says in line and line.count("\n") == 0 and line.startswith("iga-nn: ")
    assert [path.name for path in Path().rglob("*")] == ["map.npz"]


def test_a_name_far_from_all_others_gets_no_suggestion(in_folder, capsys):
    assert main(["parameterize", "zzz"]) == 2
    assert "did you mean" not in capsys.readouterr().err


def test_one_good_name_lets_a_batch_begin(formula_training, in_this_process, in_folder, capsys):
    formula_training()
    assert main(["batch", "cube", "beann", "--refine", "0", "--out", "out"]) == 2
    assert "did you mean bean?" in Path("out/batch.csv").read_text()
    assert (Path("out/cube/report.html").is_file(), Path("out/beann").exists()) == (True, False)


def test_an_interrupted_run_leaves_no_empty_folder_nor_those_above_it(formula_training, in_folder, capsys):
    formula_training(error=KeyboardInterrupt())
    Path("kept").mkdir()
    assert main(["parameterize", "cube", "--out", "kept/new/er/out"]) == 130
    assert [str(path) for path in Path().rglob("*")] == ["kept"]


def test_a_folder_of_the_user_stays_where_nothing_came_into_it(formula_training, in_folder, capsys):
    formula_training(error=KeyboardInterrupt())
    Path("own").mkdir()
    assert main(["parameterize", "cube", "--out", "own"]) == 130
    assert Path("own").is_dir()


def test_a_folder_that_another_run_made_meanwhile_is_its_own(in_folder):
    with open_folder("cube", "out", force=False) as second:
        assert not Path("out").exists()
        with open_folder("cube", "out", force=False) as first:
            first.begin("map")
            with pytest.raises(InputError, match="out: cannot be written"):
                second.begin("map")
            assert Path("out").is_dir()
    assert not Path("out").exists()


def test_a_solve_makes_its_folder_once_the_volume_is_read(in_folder, monkeypatch, capsys):
    benchmark_volume(2).save("map.npz")
    read = BSplineVolume.load

    def watched(path):
        assert not Path("map").exists()
        return read(path)

    monkeypatch.setattr(BSplineVolume, "load", watched)
    assert main(["solve", "poisson", "map.npz", "--refine", "0"]) == 0
    assert Path("map/report.html").is_file()


@pytest.mark.parametrize("arguments", [["solve", "poisson"], ["study"]])
def test_what_a_training_reported_is_not_replaced_by_a_solve(arguments, formula_training, in_folder, capsys):
    """Its report says how the map was made and how good it is; --force replaces a solve by another one only."""
    formula_training()
    assert main(["parameterize", "cube", "--out", "out"]) == 0
    before = {file.name: file.read_bytes() for file in Path("out").iterdir()}
    assert main([*arguments, "out/volume.npz", "--refine", "0", "--out", "out", "--force"]) == 2
    assert "out: holds a map and the report of its training" in capsys.readouterr().err.splitlines()[-1]
    assert {file.name: file.read_bytes() for file in Path("out").iterdir()} == before
    for _ in range(2):
        assert main([*arguments, "out/volume.npz", "--refine", "0", "--out", "other", "--force"]) == 0


@pytest.mark.parametrize("other", [["bean", "--seed", "3"], ["ellipsoid"], ["bean", "--steps-factor", "0.5"]])
def test_a_checkpoint_of_another_run_is_refused_before_anything_is_computed(
    other, in_folder, short_training, capsys, monkeypatch
):
    def interrupted(now):
        if now.stage == "cube":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        iga_nn.run("poisson", "bean", "out", progress=interrupted)
    before = {file: file.read_bytes() for file in Path("out").rglob("*") if file.is_file()}
    monkeypatch.setattr("parameterize.run.identity_of", identity_of_short)
    monkeypatch.setattr("iga_nn.workflow.mapping.forecast", lambda *_, **__: pytest.fail("too late"))
    assert main(["run", "poisson", *other, "--out", "out", "--resume"]) == 2
    assert "belongs to another run (" in capsys.readouterr().err
    assert {file: file.read_bytes() for file in Path("out").rglob("*") if file.is_file()} == before


def identity_of_short(surface, config, **given):
    """As the short training of the fixture shortens the config."""
    short = shortened(config)
    return identity_of(surface, short.with_control_points(min(8, short.spline.control_points)), **given)


def test_a_batch_whose_options_are_refused_leaves_no_folder(in_folder, capsys):
    assert main(["batch", "cube", "--out", "new/er/out", "--memory-limit", "1XB"]) == 2
    assert list(in_folder.iterdir()) == []
