"""Defines PressedFace: a face that holds displacements weakly, under a known pressure."""

from dataclasses import dataclass, fields

from parameterize.arrays import Array

from .weak import WeakFace


@dataclass(frozen=True, eq=False)
class PressedFace(WeakFace):
    """Hold the terms of a WeakFace whose flux has a given pressure (m,) besides that of the displacement."""

    pressure: Array

    @classmethod
    def of(cls, face: WeakFace, p: Array) -> "PressedFace":
        """Return a face under the pressure with coefficients p (k, 1, n_u, n_v, n_w)."""
        own = {field.name: getattr(face, field.name) for field in fields(WeakFace)}
        return cls(**own, pressure=face.values_of(p)[0])

    def traces(self, coefficients: Array) -> tuple[Array, Array]:
        """Return u (c, m) and t (c, m), the flux through the face with that of the pressure."""
        u, flux = super().traces(coefficients)
        return u, flux - self.pressure * self.normal
