"""From a closed surface to a trivariate B-spline volume without folds.

The solid P inside the surface becomes the image of the unit cube under a tensor-product spline

    F(u, v, w) = sum_ijk P_ijk N_i(u) N_j(v) N_k(w),    J = (F_u, F_v, F_w),    det J > 0 on the whole cube.

Method (Zhan, Wang, Chen, CMAME 441, 2025, 117988; lengths such that P has volume 1, (x)_+ = max(x, 0)):

1. Train (`training`). A network learns the inverse map G from P to the cube. With c the cube's
   centre, A a constant matrix and k trained,

       G(x) = c + A (x - c) + MLP(e(x)),    e(x) = (x, sin(n k x) / (n k), cos(n k x) / (n k)),  n = 1, ..., 10.

   Four stages draw the mapped surface to simpler shapes: to the cube grown by 2, then by 1, scaled to volume 1 (S(2)
   and S(1), which are round); to the cube; to the cube with eight vertices held at its corners; and with the paths
   between them held on its edges. The loss is a weighted sum of means; over points of P, with K = dG/dx and
   its singular values s_i,

       bij   (alpha - det K)_+^2                     folds
       arap  det K sum_i (1 / s_i - 1)^2             distortion of the inverse of G
       fair  sum_ab |d2 G / dx_a dx_b|^2             smoothness

   and over the mapped surface, with its points y, normals n, and what is nearest to them on the shape, y* and n*,

       dist  |y - y*|^2                              position
       norm  |n - n*|^2 + 100 (-<n, n*>)_+           direction; the second part once the shape is the cube
       star  (-<y - c, n> / |y - c|)_+^2             seen from c, the mapped surface shows its inner side only

   `cor` and `edge` are `dist` of the corners and of the paths, these with |t - t*|^2 / 1000 of their directions t.

2. Fit (`optimization.least_squares`). Surface points take places q on the cube's faces, one-to-one where that
   succeeds; F minimises

       sum_x |F(G(x)) - x|^2 + sum_y |F(q_y) - y|^2 + fairness int |Hess F|^2    (weighted; x inside, y on the surface).

3. Optimise (`optimization`). Newton steps on the control points, the places q sliding between them, lower

       int a + s (a - l)_+^2 du dv dw + fairness int |Hess F|^2    a = |J - R|^2 = sum_i (sigma_i - 1)^2, the distortion
       + vertex sum_y r^T (n n^T + t I) r                          r = F(q_y) - y, measured along the normals n at y
       + penalty (int (m - det J)_+^2 + mean (b - beta)_+^2)       beta: the Bernstein coefficients of det J below

   where R is the rotation closest to J, sigma_i are the singular values of J, the smallest with the sign of det J, and
   the rest are options (`config.SplineConfig`). beta is watched on the spans along the cube's edges and wherever the
   certificate has failed before. Further, weaker terms hold F's edges to the surface
   (`optimization.edge_attraction`) and let its faces look the way the mesh does (`optimization.normals`). Rounds with
   a growing penalty end soon after the map is certified. (The paper penalises det J at samples alone, holds the
   places, and stops after a number of steps.)

Certificate (`certificate`). With s the coordinates within a knot span, det J there is a polynomial of
degree m = 3 p - 1 in each of them:

    det J = sum_abc beta_abc B_a(s_1) B_b(s_2) B_c(s_3),    B_a(s) = (m over a) s^a (1 - s)^(m - a).

B_a >= 0 and sum_a B_a = 1, so min beta <= det J <= max beta, and the beta at the eight corners are values of det J.
With eps a bound of all rounding errors made in beta:

    all beta > eps on all spans      certified: det J > 0 is proved on the whole cube
    a corner's beta < -eps           folded: det J < 0 there, the witness
    otherwise                        the span is cut into eight (de Casteljau), where the bounds are closer; what is
                                     left after six cuts is undecided

det J > 0 makes F one-to-one near every point, and with a boundary that does not meet itself
(`certificate.boundary`) at large.

>>> import numpy as np
>>> from parameterize import BSplineVolume, certify
>>> corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1)
>>> cube = BSplineVolume.uniform(corners, degree=1)  # control points (2, 2, 2, 3)
>>> certify(cube).verdict, certify(cube).mean_det
('certified', 1.0)
>>> corners[1, 1, 1] = 0, 0, 0  # one corner is pushed onto the opposite one
>>> pushed = BSplineVolume.uniform(corners, degree=1)
>>> certify(pushed).verdict
'folded'
>>> bool(np.linalg.det(pushed.jacobian([certify(pushed).witness]))[0] < 0.0)
True

The names below are loaded on first use. Only `parameterize` and `Parameterization` bring in torch, for
the training.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .certificate.jacobian import Certificate, certify
    from .config import Config, preset
    from .cube.boundary_map import BoundaryMap
    from .quality.quality import QualityReport, measure
    from .run import Parameterization, parameterize
    from .spline.volume import BSplineVolume
    from .surface.surface import MeshError, Surface, load_surface, surface_from_arrays

_HOME = {
    "certificate.jacobian": ("Certificate", "certify"),
    "config": ("Config", "preset"),
    "cube.boundary_map": ("BoundaryMap",),
    "quality.quality": ("QualityReport", "measure"),
    "run": ("Parameterization", "parameterize"),
    "spline.volume": ("BSplineVolume",),
    "surface.surface": ("MeshError", "Surface", "load_surface", "surface_from_arrays"),
}

__all__ = [
    "BSplineVolume",
    "BoundaryMap",
    "Certificate",
    "Config",
    "MeshError",
    "Parameterization",
    "QualityReport",
    "Surface",
    "certify",
    "load_surface",
    "measure",
    "parameterize",
    "preset",
    "surface_from_arrays",
]


def __getattr__(name: str) -> Any:
    """Load a public name from the module it lives in (PEP 562)."""
    for home, names in _HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module 'parameterize' has no attribute {name!r}")
