"""Defines MixedSystem: the linear system of a nearly incompressible body, for its displacement and its pressure."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult
from parameterize.spline.body import Body
from parameterize.threads import one_blas_thread

from .assembly import assemble_body_data
from .discretization.divergence import Divergence
from .discretization.error_norms import Compared
from .discretization.groups import OnPatches
from .discretization.pressed_face import PressedFace
from .discretization.pressure import LEAST_DEGREE, Pressures
from .discretization.unknowns import unknowns_of
from .field import BodyField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.coupled import demand_uncoupled
from .forms.elasticity import Elasticity
from .forms.under_law import UnderLaw
from .linear.pressure_mass import PressureMass
from .linear.saddle import Pair, Saddle, saddle_point
from .options import IterationOptions, SolveOptions
from .patch_system import PatchProblem
from .reactions import Balance, balance
from .system import System, system_of


@dataclass(frozen=True, eq=False, kw_only=True)
class MixedSystem(System):
    """State a nearly incompressible body as a linear system of displacements u and pressures p.

    int 2 mu eps(u) : eps(v) - p div v - r div u - r p / lambda = the loads, for all v and r. A vector has the N
    displacements of `System`, then the pressures. The matrix is symmetric and has eigenvalues of either sign: MINRES
    solves it with `preconditioner`, which is positive.
    """

    displacement: System  # of the law 2 mu eps
    pressures: Pressures
    divergence: Divergence
    mass_of_pressures: PressureMass

    formulation = "mixed"

    def _halves(self, x: Array) -> Pair:
        """Return the displacements (3, ...) and the pressures (count,) of a vector."""
        of_u = self.displacement.right
        return x[: of_u.size].reshape(of_u.shape), x[of_u.size :]

    def _spread(self, p: Array) -> OnPatches:
        """Return the coefficients (1, n_u, n_v, n_w) on each patch of pressures (count,)."""
        return replace(self.matrix.layout.empty(1), flat=self.pressures.matrix @ p)

    def _stiffness(self, u: Array) -> Pair:
        on_patches = self.matrix.layout.joined(self.unknowns.spread(u))
        forces = self.unknowns.collect(self.matrix.apply(on_patches))
        return forces, self.pressures.transposed @ self.divergence.of_displacement(on_patches).flat

    def _coupling(self, p: Array) -> Pair:
        forces, volumes = parted(self.divergence.of_pressure(self._spread(p)))
        return self.unknowns.collect(forces), self.pressures.transposed @ volumes.flat

    @property
    def saddle(self) -> Saddle:
        """Return the matrix and its preconditioner."""
        return Saddle(self._stiffness, self._coupling, self.displacement.precondition, self.mass_of_pressures)

    def product(self, x: Array) -> Array:
        """Return A times a vector (N,)."""
        return _vector(self.saddle.product(self._halves(x)))

    def precondition(self, residual: Array) -> Array:
        """Return the preconditioner times a vector (N,)."""
        forces, volumes = self._halves(residual)
        return _vector((self.displacement.precondition(forces), self.mass_of_pressures(volumes)))

    def vector(self, field: Any) -> Array:
        """Return the vector (N,) of a displacement without pressure."""
        return np.append(super().vector(field), np.zeros(self.pressures.count))

    def _filled(self, free: Array) -> list[Array]:
        """Return the coefficients (4, n_u, n_v, n_w) of displacement and pressure of each patch."""
        u, p = self._halves(free)
        parts = zip(super()._filled(u), self._spread(p), strict=True)
        return [np.concatenate(part) for part in parts]

    def _field(self, full: Sequence[Array]) -> BodyField:
        found = super()._field([own[:3] for own in full])
        patches = zip(found.patches, full, strict=True)
        return replace(found, patches=tuple(replace(patch, pressure=own[3]) for patch, own in patches))

    def _iterate(self, options: IterationOptions, guess: Array | None = None) -> LinearResult:
        if options.start is not None:
            guess = self.vector(options.start)
        limits = options.tolerance, options.max_iterations
        start = None if guess is None else self._halves(guess)
        found = saddle_point(self.saddle, self._halves(self.right), *limits, start)
        return replace(found, x=_vector(found.x))

    def _size(self, x: Array) -> float:
        right = self._halves(self.right)
        return self.saddle.size(right)(self._halves(self.right - self.product(x)))

    def _parts(self, full: Sequence[Array]) -> list[Compared]:
        return super()._parts([own[:3] for own in full])

    @property
    def _unknown(self) -> str:
        """Return why the error is not estimated."""
        return "the estimate of a displacement with a pressure is not known"

    def _balance(self, full: Sequence[Array]) -> Balance:
        layout = self.matrix.layout
        u, p = layout.joined([own[:3] for own in full]), layout.joined([own[3:] for own in full])
        forces, _ = parted(self.divergence.of_pressure(p))
        faces = [PressedFace.of(face, p.of(face.patches)) for face in self.matrix.weak]
        return balance(self.problem, self.patches, self.unknowns, faces, u, forces + self.matrix.apply(u))


def parted(both: OnPatches) -> tuple[OnPatches, OnPatches]:
    """Return the first three components and the fourth one on each patch."""
    layout = both.layout
    forces, volumes = layout.empty(3), layout.empty(1)
    for own, of_u, of_p in zip(both.in_groups, forces.in_groups, volumes.in_groups, strict=True):
        of_u[:], of_p[:] = own[:, :3], own[:, 3:]
    return forces, volumes


def _vector(x: Pair) -> Array:
    return np.concatenate([x[0].ravel(), x[1]])


def is_mixed(problem: BoundaryValueProblem, patches: Sequence[PatchProblem], options: SolveOptions) -> bool:
    """Return whether the mixed form is asked for, or is right for a nearly incompressible body.

    Raises ValueError where it is asked for and there is none.
    """
    if options.formulation == "displacement":
        return False
    fault = _fault(problem, patches, options)
    if options.formulation == "mixed" and fault:
        raise ValueError(f"formulation 'mixed': {fault}")
    return not fault and (options.formulation == "mixed" or bool(problem.form.caveat))


def _fault(problem: BoundaryValueProblem, patches: Sequence[PatchProblem], options: SolveOptions) -> str:
    """Return why a problem has no mixed form; "" where it has one."""
    if not isinstance(problem, Elasticity):
        return f"{type(problem).__name__} has no pressure, only Elasticity has one"
    if not all(patch.problem.constants[0] > 0.0 for patch in patches):  # type: ignore[attr-defined]
        return "poisson_ratio must be positive on all patches"
    if (least := min(min(patch.space.degrees) for patch in patches)) < LEAST_DEGREE:
        return f"the degree must be at least {LEAST_DEGREE}, got {least}"
    if options.comm is not None and options.comm.size > 1:
        return "one process solves it: leave comm out"
    if options.device != "cpu":
        return f"it is solved on device='cpu' only, got device={options.device!r}"
    return ""


def build_mixed(
    body: Body, problem: BoundaryValueProblem, patches: Sequence[PatchProblem], options: SolveOptions
) -> MixedSystem:
    """Return the mixed system of an elastic body; arguments as in `system.build`."""
    demand_uncoupled(problem, "it is solved with formulation='displacement' only")
    start = time.process_time()
    laws: list[Any] = [patch.problem for patch in patches]
    with one_blas_thread():
        soft: list[Any] = [UnderLaw(law, law.without_volume()) for law in laws]
        stated = [replace(patch, problem=law) for patch, law in zip(patches, soft, strict=True)]
        unknowns = unknowns_of([patch.space for patch in patches], body.interfaces)
        found = assemble_body_data(stated, options)
        displacement = system_of(body, problem, patches, unknowns, found, is_loose=False)
        divergence = Divergence(displacement.matrix, np.array([1.0 / law.constants[0] for law in laws]))
        constants = [law.constants for law in laws]
        same = [one for one in body.interfaces if constants[one.first[0]] == constants[one.second[0]]]
        pressures = Pressures.of(displacement.matrix.layout, [patch.space for patch in patches], same)
        mass = PressureMass.of(pressures, displacement.matrix.laws, _weighed(divergence, pressures, constants))
        volumes = pressures.transposed @ _volumes_given(displacement, divergence)
    shared: dict[str, Any] = {field.name: getattr(displacement, field.name) for field in fields(System)}
    shared |= {"right": np.append(displacement.right, volumes), "setup": time.process_time() - start}
    return MixedSystem(
        **shared,
        displacement=displacement,
        pressures=pressures,
        divergence=divergence,
        mass_of_pressures=mass,
    )


def _weighed(divergence: Divergence, pressures: Pressures, constants: Sequence[tuple[float, float]]) -> list[Array]:
    """Return for each patch the integrals (m_u, m_v, m_w) of 1 / (2 mu) + 1 / lambda times each pressure."""
    weighing = replace(divergence, compliance=np.array([1.0 / first + 0.5 / shear for first, shear in constants]))
    one = divergence.matrix.layout.empty(1)
    one.flat[:] = 1.0
    parts = zip(weighing.of_pressure(one), pressures.of_patches, strict=True)
    return [-np.einsum("abc,ai,bj,ck->ijk", own[3], *each, optimize=True) for own, each in parts]


def _volumes_given(displacement: System, divergence: Divergence) -> Array:
    """Return the right-hand side of the volumes, from the displacements that are given, on all patches."""
    layout = displacement.matrix.layout
    found = divergence.of_displacement(layout.joined([patch.known for patch in displacement.patches]))
    given = replace(found, flat=-found.flat)
    for face in divergence.faces:
        face.add_load(given)
    return given.flat
