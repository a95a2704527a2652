"""Says which directions of u the conditions hold at points of the boundary."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body
from parameterize.spline.interface import face_label
from parameterize.spline.volume import FACE_NAMES

from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.conditions import Condition, Value
from ..forms.region import FacesOfPoints, tolerances

_PARALLEL = 1e-6  # length of a direction's part that no other direction holds, from which on it is held too


@dataclass(frozen=True, eq=False)
class Supports:
    """Evaluate the conditions that give values of u. problems: those of the patches of a body."""

    body: Body
    problems: Sequence[BoundaryValueProblem]

    @cached_property
    def conditions(self) -> list[Condition]:
        """Return the conditions on regions that give values."""
        return [one for one in self.problems[0].conditions if isinstance(one, Value)]

    @cached_property
    def is_of_faces(self) -> bool:
        """Return whether all conditions hold on whole faces of patches."""
        return all(one.faces for one in self.conditions)

    @cached_property
    def held_faces(self) -> dict[int, Value]:
        """Return the values on whole faces 6 * patch + face that keywords of faces give."""
        found = {}
        for patch, problem in enumerate(self.problems if not self.problems[0].conditions else ()):
            for name in problem.dirichlet:
                strong = problem.strong_on(name)
                if strong is not None:
                    found[len(FACE_NAMES) * patch + FACE_NAMES.index(name)] = strong
        return found

    @cached_property
    def names(self) -> list[str]:
        """Return the words for each bit of a code."""
        of_faces = dict.fromkeys(map(_words, self.held_faces.values()))
        return [one.role for one in self.conditions] or list(of_faces)

    @property
    def hold_nothing(self) -> bool:
        """Return whether no condition gives values."""
        return not self.conditions and not self.held_faces

    def codes(self, faces: IntArray, x: Array, normal: Array) -> IntArray:
        """Return bit i where condition i holds, at points (3, m) with normals (3, m) of faces 6 * patch + face (m,)."""
        found = np.zeros(len(faces), dtype=np.int64)
        if not self.conditions:
            bits = {face: 1 << self.names.index(_words(one)) for face, one in self.held_faces.items()}
            present, owners = np.unique(faces, return_inverse=True)
            return np.array([bits.get(face, 0) for face in present.tolist()], dtype=np.int64)[owners]
        present, owners = np.unique(faces, return_inverse=True)
        patches, numbers = np.divmod(present, len(FACE_NAMES))
        single = self.body.is_single
        names = [
            FACE_NAMES[f] if single else face_label(p, FACE_NAMES[f])
            for p, f in zip(patches.tolist(), numbers.tolist(), strict=True)
        ]
        on = FacesOfPoints(names, owners, self._near[present][owners])
        for i, condition in enumerate(self.conditions):
            found |= condition.region.holds_on(x, normal, on).astype(np.int64) << i
        return found

    @cached_property
    def _near(self) -> Array:
        """Return the tolerance of positions on each face, (6 * patches,)."""
        found = np.zeros((len(self.body), len(FACE_NAMES)))
        for group in self.body.groups:
            for number in range(len(FACE_NAMES)):
                layer = np.take(group.control_points, -(number % 2), axis=1 + number // 2)
                found[group.numbers, number] = tolerances(layer.reshape(len(group), -1, 3))
        return found.ravel()

    def projectors(self, codes: IntArray, normal: Array) -> Array:
        """Return the projectors (m, c, c) onto the held directions at points with codes (m,) and normals (3, m)."""
        components = self.problems[0].form.components
        found = np.zeros((len(codes), components, components))
        if not self.conditions:
            found[codes > 0] = np.eye(components)
            return found
        for i, condition in enumerate(self.conditions):
            here = np.flatnonzero(codes >> i & 1)
            if not len(here) or not isinstance(condition, Value):
                continue
            for direction in condition.directions(components, normal[:, here]):
                new = direction.T - np.einsum("mcd,dm->mc", found[here], direction)
                size = np.linalg.norm(new, axis=1)
                new[size > _PARALLEL] /= size[size > _PARALLEL, None]
                new[size <= _PARALLEL] = 0.0
                found[here] += new[:, :, None] * new[:, None, :]
        return found


def _words(condition: Condition) -> str:
    """Return the words for a condition of a keyword of faces."""
    return f"the {condition.role} on {condition.region}"
