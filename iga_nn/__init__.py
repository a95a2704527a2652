"""Takes a closed surface mesh to a solved PDE on a certified trivariate B-spline.

docs/method.md explains the map and its certificate with formulas, docs/solver.md the discretisation and its
preconditioner, docs/output.md the files.

The public names are loaded on first use: importing the package loads neither torch nor VTK.
"""

import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .version import __version__

# Threads that wait for each other by spinning are 9 times slower once another program wants a core (measured), and
# no faster on an idle machine. The runtime reads this once, when torch is loaded.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

_HOME = {  # module, and the name there where it is another one; type checkers read __init__.pyi
    "Adapted": "solve",
    "Ask": "solve",
    "BSplineVolume": "parameterize.spline.volume",
    "Bearing": "solve.forms.conditions",
    "Body": "parameterize.spline.body",
    "Cyclic": "solve.forms.conditions",
    "Elasticity": "solve",
    "ElasticityOptions": "iga_nn.options",
    "Exchange": "solve.forms.conditions",
    "FiniteOptions": "iga_nn.options",
    "Fix": "solve.forms.conditions",
    "Flux": "solve.forms.conditions",
    "Form": "solve",
    "Foundation": "solve.forms.conditions",
    "Grading": "solve",
    "Hydrostatic": "solve.forms.conditions",
    "InputError": "iga_nn.errors",
    "Interface": "parameterize.spline.interface",
    "Load": "solve.forms.conditions",
    "MapOptions": "iga_nn.options",
    "March": "solve",
    "Material": "solve",
    "MeshError": "parameterize.surface.surface",
    "Modes": "solve",
    "Moment": "solve.forms.conditions",
    "MooneyRivlin": "solve.forms.hyperelasticity",
    "NeoHookean": "solve.forms.hyperelasticity",
    "Parameterization": "parameterize.run",
    "PlasticOptions": "iga_nn.options",
    "Plasticity": "solve.forms.plasticity",
    "Poisson": "solve",
    "PoissonOptions": "iga_nn.options",
    "Pressure": "solve.forms.conditions",
    "Problem": "solve",
    "Region": "solve",
    "RemoteForce": "solve.forms.conditions",
    "Rigid": "solve.forms.conditions",
    "Robin": "solve.forms.conditions",
    "Roller": "solve.forms.conditions",
    "SplineField": "solve",
    "Spring": "solve.forms.conditions",
    "Surface": "parameterize.surface.surface",
    "Symmetry": "solve.forms.conditions",
    "System": "solve",
    "TimeLimitError": "iga_nn.errors",
    "TotalForce": "solve.forms.conditions",
    "TotalSpring": "solve.forms.conditions",
    "Turn": "solve.forms.conditions",
    "Value": "solve.forms.conditions",
    "VolumeMesh": "parameterize.meshes.mesh",
    "WorkerOptions": "iga_nn.options",
    "Yeoh": "solve.forms.hyperelasticity",
    "adaptive": "solve",
    "certify": "parameterize.certificate.certify",
    "certify_mesh": "parameterize.meshes.certify",
    "convergence": "solve",
    "discretize": "solve",
    "export": "iga_nn.io.export",
    "integrate": "solve",
    "load_solution": "iga_nn.io.solutions",
    "load_mesh": "iga_nn.io.meshes",
    "load_surface": "parameterize.surface.surface",
    "load_volume": "iga_nn.io.formats",
    "march": "solve",
    "material": "solve",
    "modes": "solve",
    "newton": "solve",
    "parameterize": "parameterize.run",
    "preset": "parameterize.config",
    "resultant": "solve",
    "run": "iga_nn.workflow.pipeline",
    "run_batch": "iga_nn.batch.run_batch",
    "sample": "iga_nn.samples",
    "solve": "solve:solve_problem",
}
__all__ = ["__version__", *_HOME]


def _refuse_shadowed(*names: str) -> None:
    """Raise ImportError where a file of the user hides one of our packages, whose names are common."""
    for name in names:
        spec = find_spec(name)
        found = Path(spec.origin).resolve() if spec and spec.origin else None
        if found is None or found.parent.parent != Path(__file__).resolve().parent.parent:
            raise ImportError(
                f"iga_nn needs its own package '{name}', but '{name}' is {found or 'not installed'}; "
                f"rename that file, or start Python with 'python -P' so that the script's folder is not searched first"
            )


_refuse_shadowed("parameterize", "solve")


def __getattr__(name: str) -> Any:
    """Load a public name from its module (PEP 562)."""
    if name not in _HOME and not name[0].isupper():  # such as a module of this package, which needs no other one
        raise AttributeError(f"module 'iga_nn' has no attribute {name!r}")
    if name not in _HOME:
        from parameterize.old_names import renamed

        return __getattr__(renamed("iga_nn", name))
    module, _, attribute = _HOME[name].partition(":")
    value = getattr(import_module(module), attribute or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
