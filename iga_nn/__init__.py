"""From a closed surface mesh to a solved PDE on a certified trivariate B-spline.

The docstrings of these modules explain what is done, with formulas: `parameterize` the method and the certificate,
`solve` the discretisation and its preconditioner, `iga_nn.io.formats` the files.

The public names below are loaded on first use: importing the package brings in neither torch nor VTK.
"""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .version import __version__

# Threads that wait for each other by spinning are 9 times slower once another program wants a core (measured), and
# no faster on an idle machine. The runtime reads this once, when torch is loaded.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def _refuse_shadowed(*names: str) -> None:
    """Raise ImportError where a file of the user's hides one of our packages, whose names are common ones."""
    for name in names:
        spec = find_spec(name)
        found = Path(spec.origin).resolve() if spec and spec.origin else None
        if found is None or found.parent.parent != Path(__file__).resolve().parent.parent:
            raise ImportError(
                f"iga_nn needs its own package '{name}', but '{name}' is {found or 'not installed'}; "
                f"rename that file, or start Python with 'python -P' so that the script's folder is not searched first"
            )


_refuse_shadowed("parameterize", "solve")

if TYPE_CHECKING:
    from parameterize.certificate.jacobian import certify
    from parameterize.config import preset
    from parameterize.run import Parameterization, parameterize
    from parameterize.spline.volume import BSplineVolume
    from parameterize.surface.surface import MeshError, Surface, load_surface
    from solve import Elasticity, Poisson, convergence
    from solve import solve_problem as solve

    from .errors import InputError
    from .io.formats import export, load_volume
    from .options import ElasticityOptions, MapOptions, PoissonOptions
    from .samples import sample
    from .workflow.pipeline import run

_HOME = {
    "BSplineVolume": "parameterize.spline.volume",
    "Elasticity": "solve",
    "ElasticityOptions": "iga_nn.options",
    "InputError": "iga_nn.errors",
    "MapOptions": "iga_nn.options",
    "MeshError": "parameterize.surface.surface",
    "Parameterization": "parameterize.run",
    "Poisson": "solve",
    "PoissonOptions": "iga_nn.options",
    "Surface": "parameterize.surface.surface",
    "certify": "parameterize.certificate.jacobian",
    "convergence": "solve",
    "export": "iga_nn.io.formats",
    "load_surface": "parameterize.surface.surface",
    "load_volume": "iga_nn.io.formats",
    "parameterize": "parameterize.run",
    "preset": "parameterize.config",
    "run": "iga_nn.workflow.pipeline",
    "sample": "iga_nn.samples",
    "solve": "solve:solve_problem",
}

__all__ = [
    "BSplineVolume",
    "Elasticity",
    "ElasticityOptions",
    "InputError",
    "MapOptions",
    "MeshError",
    "Parameterization",
    "Poisson",
    "PoissonOptions",
    "Surface",
    "__version__",
    "certify",
    "convergence",
    "export",
    "load_surface",
    "load_volume",
    "parameterize",
    "preset",
    "run",
    "sample",
    "solve",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the module it lives in (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'iga_nn' has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    value = getattr(import_module(module), attribute or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
