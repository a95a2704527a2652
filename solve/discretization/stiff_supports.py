"""Holds regions by stiff supports, which serve any law: the force that answers a displacement is that of springs.

On a region where u . d = h is given, P the projector on the directions d, the term of the supports is

    int s P (u - g) . P v,        s = STIFF times Nitsche's parameter of the law at rest.

It has no flux of the law, whose derivative may vanish where a body yields or wrinkles, so that the matrix stays
symmetric and positive whatever the law does. The price is that a region gives way by its traction over s. The thickness
of the span behind it divided by 1 000 and more, of the elastic strain there, is all that this is.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..forms.at_rest import Still
from .grouped import BodyMatrix
from .groups import OnPatches
from .weak import WeakFace

STIFF = 100.0  # times Nitsche's parameter, which is 18 (degree 2) and more times the modulus over the span's thickness


def on_stiff_supports(matrix: BodyMatrix, loads: OnPatches) -> tuple[BodyMatrix, OnPatches]:
    """Return a matrix and its loads with stiff supports in the place of Nitsche's terms."""
    stiff, changed = [], replace(loads, flat=loads.flat.copy())
    for face in matrix.faces:
        if not isinstance(face, WeakFace) or not face.projector.any():
            stiff.append(face)
            continue
        held = replace(face, form=Still(len(face.projector)), gamma=STIFF * face.gamma, initial=0.0 * face.initial)
        stiff.append(held)
        if face.values.any() or face.initial.any():
            for one, sign in ((face, -1.0), (held, 1.0)):
                found = np.zeros((len(face.patches), loads.components, *loads.layout.shapes[face.patches[0]]))
                replace(one, loads=np.zeros_like(one.loads)).add_load(found)
                changed.add(face.patches, sign * found)
    return matrix.with_faces(stiff), changed


def given_way(faces: Sequence[WeakFace], coefficients: OnPatches) -> float:
    """Return the largest distance by which a held region gives way."""
    largest = 0.0
    for face in faces:
        missing = np.einsum("cdm,dm->cm", face.projector, face.values_of(coefficients.of(face.patches))) - face.values
        largest = max(largest, float(np.linalg.norm(missing, axis=0).max(initial=0.0)))
    return largest
