"""From a closed surface to a trivariate B-spline volume without folds.

The solid inside the surface becomes the image of the unit cube under a tensor-product spline

    F(u, v, w) = sum_ijk P_ijk N_i(u) N_j(v) N_k(w),    J = (F_u, F_v, F_w),    det J > 0 on the whole cube.

A network learns the inverse map (`training`), F is fitted to it (`optimization.least_squares`) and optimised
(`optimization`), and Bernstein coefficients prove that it folds nowhere (`certificate`). docs/method.md explains the
method with its formulas (Zhan, Wang, Chen, CMAME 441, 2025, 117988).

>>> import numpy as np
>>> from parameterize import BSplineVolume, certify
>>> corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1)
>>> cube = BSplineVolume.uniform(corners, degree=1)  # control points (2, 2, 2, 3)
>>> certify(cube).verdict, round(certify(cube).mean_det, 9)
('certified', 1.0)
>>> corners[1, 1, 1] = 0, 0, 0  # one corner is pushed onto the opposite one
>>> pushed = BSplineVolume.uniform(corners, degree=1)
>>> certify(pushed).verdict
'folded'
>>> bool(np.linalg.det(pushed.jacobian([certify(pushed).witness]))[0] < 0.0)
True

The names below are loaded on first use. Only `parameterize` and `Parameterization` bring in torch, for the training.
"""

from importlib import import_module
from typing import Any

from .kernel_cache import provide_folder

provide_folder()  # before the first module with kernels is loaded

_HOME = {  # type checkers read __init__.pyi
    "BSplineVolume": "spline.volume",
    "Body": "spline.body",
    "BoundaryMap": "cube.boundary_map",
    "Certificate": "certificate.certify",
    "Config": "config",
    "MeshError": "surface.surface",
    "Parameterization": "run",
    "PatchCertificate": "certificate.jacobian",
    "QualityReport": "quality.quality",
    "Surface": "surface.surface",
    "certify": "certificate.certify",
    "load_surface": "surface.surface",
    "measure": "quality.quality",
    "parameterize": "run",
    "preset": "config",
    "surface_from_arrays": "surface.surface",
}
__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    """Load a public name from the module it lives in (PEP 562)."""
    if name not in _HOME:
        from .old_names import renamed

        return __getattr__(renamed("parameterize", name))
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
