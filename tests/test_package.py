from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

import iga_nn
from solve.forms import conditions

NUMERICS = ("numpy", "scipy", "numba", "igl", "torch", "matplotlib", "vtk", "pyvista", "trimesh", "meshio")
HEAVY = ("torch", "vtk", "vtkmodules", "pyvista", "trame", "aiohttp", "dask", "distributed")
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
        "import iga_nn, pathlib; pathlib.Path('a.obj').write_text('v 0 0 0')\ntry: iga_nn.load_surface('a.obj')\n"
        "except iga_nn.MeshError: iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), 4)",
    ],
)
def test_no_torch_until_training_starts_and_no_vtk_until_a_figure(use, tmp_path):
    code = f"{use}\nimport sys\nprint([m for m in {HEAVY} if m in sys.modules])"
    done = python("-c", code, cwd=tmp_path)
    assert done.stdout.strip() == "[]", done.stderr


def test_exact_blocks_are_made_without_torch_and_other_heavy_libraries(tmp_path):
    code = (
        "import iga_nn, sys\n"
        "config = iga_nn.preset('fast').with_control_points(6)\n"
        "made = iga_nn.parameterize(iga_nn.sample('cube'), config, device='cpu')\n"
        f"print(made.origin, [m for m in {(*HEAVY, 'skimage', 'manifold3d')} if m in sys.modules])"
    )
    done = python("-c", code, cwd=tmp_path)
    assert done.stdout.split() == ["planes", "[]"], done.stderr


def test_every_public_name_is_there():
    for name in iga_nn.__all__:
        assert getattr(iga_nn, name) is not None
    with pytest.raises(AttributeError, match="teapot"):
        _ = iga_nn.teapot
    stub = Path(iga_nn.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    named = re.findall(r"(?: as |^)(\w+)(?:$| = )", stub, flags=re.MULTILINE)
    assert sorted(iga_nn.__all__) == sorted([*named, *conditions.__all__])


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


def test_one_module_alone_looks_upwards():
    """`import_module` is what the linter does not see."""
    upwards = [file for name in ("parameterize", "solve") for file in (ROOT / name).rglob("*.py")]
    using = {str(file.relative_to(ROOT)) for file in upwards if "import_module(" in file.read_text(encoding="utf-8")}
    own = {"parameterize/__init__.py", "parameterize/surface/readers/file.py"}  # modules beside them
    assert using == own | {"parameterize/display.py"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of the source archive, as `python -m build` makes both."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-P", "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(build, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list(folder.glob(f"iga_nn-{iga_nn.__version__}.tar.gz"))) == 1
    (built,) = folder.glob("iga_nn-*.whl")
    return built


def test_wheel_holds_the_three_packages_and_their_data(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    packages = {"iga_nn", "parameterize", "solve"}
    assert {name.split("/")[0] for name in names if not name.split("/")[0].endswith(".dist-info")} == packages
    kept = {path for name in packages for path in (ROOT / name).rglob("*") if path.is_file() and path.suffix != ".pyc"}
    assert {
        path.relative_to(ROOT).as_posix() for path in kept if "__pycache__" not in path.parts
    } <= names  # code, templates, scripts, stubs, py.typed
    assert {f"{name}/py.typed" for name in packages} <= names
    assert {
        f"iga_nn-{iga_nn.__version__}.dist-info/{name}" for name in ("entry_points.txt", "licenses/LICENSE")
    } <= names


def share_machine_code(packages):
    """Let installed files load what numba has compiled for their sources: it compares their sizes and times."""
    for name in ("parameterize", "solve"):
        for source in (ROOT / name).rglob("*.py"):
            times = source.stat()
            os.utime(packages / source.relative_to(ROOT), ns=(times.st_atime_ns, times.st_mtime_ns))
        for compiled in (ROOT / name).rglob("__pycache__/*.nb[ic]"):
            copy = packages / compiled.relative_to(ROOT)
            copy.parent.mkdir(exist_ok=True)
            shutil.copyfile(compiled, copy)


@pytest.mark.slow
def test_wheel_runs_in_an_environment_of_its_own(wheel, tmp_path):
    """Installed without its dependencies, which are those of this environment: nothing is downloaded.

    VTK, which takes half of the time of so short a run, is given no window to draw in.
    """
    venv.create(tmp_path / "env", with_pip=False)
    (packages,) = (tmp_path / "env").glob("lib/python3*/site-packages")
    (packages / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    pip = [sys.executable, "-P", "-m", "pip", "--python", str(tmp_path / "env" / "bin" / "python")]
    install = [*pip, "install", "--no-deps", "--no-index", "--no-compile", str(wheel)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(install, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    share_machine_code(packages)
    environment["VTK_DEFAULT_OPENGL_WINDOW"] = "none"
    arguments = ["--steps-factor", "0.005", "--control-points", "6", "--refine", "0", "--out", "out", "--quiet"]
    run = [tmp_path / "env" / "bin" / "iga-nn", "run", "poisson", "cube", *arguments]
    done = subprocess.run(run, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode in (0, 3), done.stderr  # so few steps may leave folds
    assert {"volume.npz", "solution.npz", "report.html"} <= {file.name for file in (tmp_path / "out").iterdir()}
    where = [tmp_path / "env" / "bin" / "python", "-P", "-c", "import iga_nn; print(iga_nn.__file__)"]
    found = subprocess.run(where, env=environment, cwd=tmp_path, capture_output=True, text=True).stdout
    assert Path(found.strip()).is_relative_to(packages)


def test_the_version_stands_in_one_place():
    written = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {iga_nn.__version__}\n" in written
    assert 'dynamic = ["version"]' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    heads = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert heads[0] == "Unreleased" or heads[0] == iga_nn.__version__
    assert iga_nn.__version__ in heads
