"""Every command and every Python block of the README is run, trainings shortened."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from small_run import shortened

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.options import MapOptions

ROOT = Path(iga_nn.__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
TRAINS = ("run", "parameterize")
SHORT = {"--steps-factor": "0.005", "--control-points": "8"}
CONFIG = MapOptions.config


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_commands_run(in_folder, monkeypatch):
    monkeypatch.setattr(MapOptions, "config", lambda options: shortened(CONFIG(options)))
    commands = [shlex.split(line) for block in blocks("sh") for line in block.splitlines()]
    assert len(commands) >= 8
    for program, *arguments in commands:
        if program == "make":
            assert re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
            continue
        assert program == "iga-nn"
        if arguments[0] in TRAINS:  # a short training may leave folds: exit code 3, as the README says
            added = [word for option in SHORT.items() if option[0] not in arguments for word in option]
            assert main([*arguments, *added]) in (0, 3), arguments
        else:
            folded_is_fine = arguments[0] in ("solve", "study") or "volume.npz" in arguments[1]
            assert main(arguments) in ((0, 3) if folded_is_fine else (0,)), arguments


def test_python_runs(in_folder, monkeypatch, capsys):
    full = iga_nn.preset
    monkeypatch.setattr(iga_nn, "preset", lambda name: shortened(full(name)).with_control_points(8))
    (block,) = blocks("python")
    exec(compile(block, "README.md", "exec"), {})  # noqa: S102 our own text
    out = capsys.readouterr().out
    assert "rate" in out
    assert Path("volume.npz").exists()


@pytest.mark.parametrize("code", ["0", "1", "2", "3", "4", "130"])
def test_exit_codes_are_explained(code):
    assert re.search(rf"^\| {code} \| \w", README, flags=re.MULTILINE)


def test_links_and_pictures_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    picture = ROOT / "examples" / "pictures" / "seashell.png"
    assert picture.stat().st_size < 300_000
