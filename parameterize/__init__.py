"""From a closed surface to a trivariate B-spline volume.

The names below are loaded on first use. None of them brings in torch: only `parameterize.run` does, with the training.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .boundary import BoundaryMap
    from .certificate import Certificate, certify
    from .config import Config, preset
    from .mesh import MeshError, Surface, load_surface, surface_from_arrays
    from .quality import QualityReport, measure
    from .volume import BSplineVolume

_HOME = {
    "BSplineVolume": "volume",
    "BoundaryMap": "boundary",
    "Certificate": "certificate",
    "Config": "config",
    "MeshError": "mesh",
    "QualityReport": "quality",
    "Surface": "mesh",
    "certify": "certificate",
    "load_surface": "mesh",
    "measure": "quality",
    "preset": "config",
    "surface_from_arrays": "mesh",
}

__all__ = [
    "BSplineVolume",
    "BoundaryMap",
    "Certificate",
    "Config",
    "MeshError",
    "QualityReport",
    "Surface",
    "certify",
    "load_surface",
    "measure",
    "preset",
    "surface_from_arrays",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the module it lives in (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'parameterize' has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value
