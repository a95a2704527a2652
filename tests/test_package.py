from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import iga_nn

NUMERICS = ("numpy", "scipy", "numba", "igl", "torch", "matplotlib", "vtk", "pyvista", "trimesh", "meshio")
HEAVY = ("torch", "vtk", "vtkmodules", "pyvista", "trame", "aiohttp")
ROOT = Path(iga_nn.__file__).resolve().parents[1]


def python(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """A fresh interpreter in another folder, as a user has it."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, *arguments], cwd=cwd, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize("option", ["--version", "--help"])
def test_version_and_help_load_no_numerics(option, tmp_path):
    code = (
        "import sys\nfrom iga_nn.cli.commands import main\n"
        f"assert main([{option!r}]) == 0\nprint([m for m in {NUMERICS} if m in sys.modules])"
    )
    done = python("-c", code, cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "[]", done.stdout + done.stderr


@pytest.mark.parametrize(
    "use",
    [
        "import iga_nn",
        "import iga_nn.cli.commands",
        "import iga_nn; iga_nn.sample; iga_nn.load_surface; iga_nn.preset; iga_nn.BSplineVolume",
        "import iga_nn; iga_nn.Poisson; iga_nn.solve; iga_nn.certify",
    ],
)
def test_no_torch_until_training_starts_and_no_vtk_until_a_figure(use, tmp_path):
    code = f"{use}\nimport sys\nprint([m for m in {HEAVY} if m in sys.modules])"
    done = python("-c", code, cwd=tmp_path)
    assert done.stdout.strip() == "[]", done.stderr


def test_every_public_name_is_there():
    for name in iga_nn.__all__:
        assert getattr(iga_nn, name) is not None
    with pytest.raises(AttributeError, match="teapot"):
        _ = iga_nn.teapot
    stub = Path(iga_nn.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    assert sorted(iga_nn.__all__) == sorted(re.findall(r"(?: as |^)(\w+)(?:$| = )", stub, flags=re.MULTILINE))


@pytest.mark.parametrize("name", ["solve", "parameterize"])
def test_a_file_that_shadows_a_package_is_named(name, tmp_path):
    shadow = tmp_path / f"{name}.py"
    shadow.write_text("x = 1\n")
    done = python("-c", "import iga_nn", cwd=tmp_path)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError") and str(shadow.resolve()) in last and "python -P" in last
    assert python("-P", "-c", "import iga_nn", cwd=tmp_path).returncode == 0


def test_python_m(tmp_path):
    done = python("-m", "iga_nn", "--version", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.strip() == f"iga-nn {iga_nn.__version__}"
    done = python("-m", "iga_nn", "check", "missing.obj", cwd=tmp_path)
    assert done.returncode == 2 and "Traceback" not in done.stderr


def test_imports_run_one_way():
    lint = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([lint, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_wheel_holds_the_three_packages(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("iga_nn-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if not name.split("/")[0].endswith(".dist-info")} == {
        "iga_nn",
        "parameterize",
        "solve",
    }
    assert {
        f"iga_nn-{iga_nn.__version__}.dist-info/{name}" for name in ("entry_points.txt", "licenses/LICENSE")
    } <= set(names)
