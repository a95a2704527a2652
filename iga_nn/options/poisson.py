"""Holds the options of Poisson's equation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal  # noqa: F401  # Literal is in the annotations of ProblemOptions

from ..errors import InputError, input_errors
from . import texts
from .materials import materials_of, of_all
from .problem import Formula, ProblemOptions, Row, Sheet, by_patch
from .space_check import check_space

if TYPE_CHECKING:
    from solve import Material, Poisson


@dataclass(frozen=True)
class PoissonOptions(ProblemOptions):
    """State -div(kappa grad u) + c u = f on the volume, with data on its six faces, and the meshes it is solved on.

    A formula may use x, y, z, in the input's units, and X, Y, Z, the same scaled to volume 1 about the middle of the
    volume's bounding box: X = (x - c) / V^(1/3). A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and
    so on.

    Attributes:
        exact: exact solution, a formula, from which f and g follow; errors are reported. It is exp(X+Z)*sin(Y) where
            neither f nor g is given. A formula that starts with a minus is written --exact=-x.
        source: f, a formula; of several solids also one for each, as kappa.
        boundary: g, the values of u, a formula.
        kappa: one formula, or six separated by commas for a symmetric tensor: xx,xy,xz,yy,yz,zz; of several solids also
            an entry for each by its name, "steel: 50, pad: 0.2+x", and of several patches "p0: 1, p1: 2+x". The second
            solid is solid2 if it has no name; a name with a comma or a colon stands in quotes.
        material: material of the library by its name, such as steel (`iga-nn materials` lists them), whose
            conductivity is kappa; of several solids also one for each, "body: steel, pad: rubber". It is in W/(mm K),
            with lengths in mm, or in W/(m K) with --unit m.
        reaction: c, a formula; of several solids also one for each, as kappa.
        neumann: faces with a given flux kappa du/dn, each as FACE=FORMULA, or FACE for the flux of the exact solution.
        robin: faces where kappa du/dn + alpha u = g, each as FACE=ALPHA:FORMULA, or FACE=ALPHA for the g of the exact
            solution.
        value: regions of the boundary with given values of u, each as "REGION=FORMULA", or REGION for zero or the exact
            solution. A region is a condition on position and outward normal, "nz > 0.9 and x < 2", a face of the part,
            "face(x, y, z)", a group of the mesh, group:NAME, a box(x0, y0, z0, x1, y1, z1) or a face of the cube. Where
            regions are given, all else of the boundary has no flux, and the source is zero unless it is given.
        flux: regions with a given flux kappa du/dn into the body, each as "REGION=FORMULA".
        exchange: regions where kappa du/dn = alpha (outside - u), each as "REGION=ALPHA:OUTSIDE".
        cyclic: two cuts of a sector, as "REGION, REGION about z", or "about (0, 0, 1) through (1, 2, 3)": u is equal
            on both. The angle follows from the regions.

    Examples:
        >>> import iga_nn
        >>> iga_nn.PoissonOptions(source="1", robin=("u1=2:0",), refine=(0,)).problem().robin
        {'u1': ('2', '0')}
    """

    source: Formula | None = None
    boundary: Formula | None = None
    kappa: Formula | None = None
    material: str | None = None
    reaction: Formula | None = None
    neumann: tuple[str, ...] = ()
    robin: tuple[str, ...] = ()
    value: tuple[str, ...] = ()
    flux: tuple[str, ...] = ()
    exchange: tuple[str, ...] = ()
    cyclic: tuple[str, ...] = ()

    section: ClassVar[str] = "poisson"
    title: ClassVar[str] = "Poisson's equation"
    essential: ClassVar[Row] = ("u", "boundary")
    natural: ClassVar[Row] = ("flux κ ∂u/∂n", "neumann")
    on_faces: ClassVar[tuple[str, ...]] = ("neumann", "robin")
    sheet: ClassVar[Sheet] = Sheet(
        title,
        "−div(κ grad u) + c u = f. Formulas use x, y, z, in the surface's units, or X, Y, Z, scaled to volume 1.",
        (
            ("kappa", "Coefficient κ, one formula or six: xx,xy,xz,yy,yz,zz", "1"),
            ("material", "Material by name, whose conductivity is κ, such as steel", "none"),
            ("reaction", "Reaction c", "0"),
            ("exact", "Exact solution u, from which empty data follow", "none; without a source exp(X+Z)*sin(Y)"),
            ("source", "Source f", "that of the exact solution"),
            ("boundary", "Values of u on the faces", "those of the exact solution, or 0"),
        ),
        {"kappa": "κ", "reaction": "c", "exact": "u", "source": "f", "boundary": "u on the faces"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with kappa, the reaction and the source."""
        reaction = section.get("reaction")
        rows = [("equation", f"−∇·(κ ∇u){' + c u' if reaction is not None else ''} = f")]
        kappas = [
            (f"κ of {one['name']}", f"{one['conductivity']:g} ({one['source']})")
            for one in section.get("materials", ())
        ]
        rows += [*(kappas or [("κ", section.get("kappa", "1"))]), *([] if reaction is None else [("c", reaction)])]
        return [*rows, ("f", section.get("source", ""))]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.material is not None:
            if self.kappa is not None:
                raise InputError("--material and --kappa: give one of them, the material has its own conductivity")
            for one in self.materials().values():
                if one.conductivity is None:
                    raise InputError(f"--material {one.name}: its conductivity is not known: give --kappa")
                if isinstance(one.conductivity, tuple):
                    along = ",".join(f"{part:g}" for part in one.conductivity)
                    raise InputError(
                        f"--material {one.name}: it conducts {along} along its axes: give --kappa as a tensor, "
                        "xx,xy,xz,yy,yz,zz"
                    )

    def materials(self) -> dict[Any, Material]:
        """Return the material of each solid or patch, of all of them by the key None. Raises InputError."""
        return {} if self.material is None else materials_of(self.material, self.unit)

    def values(self, *left_out: str) -> dict[str, Any]:
        """Return the options by name, with the unit of lengths and the numbers of materials."""
        found = super().values(*left_out)
        if self.material is None:
            return found
        own = {"unit": next(iter(self.materials().values())).unit} if "unit" in found else {}
        return {**found, **own, "materials": [one.as_dict() for one in self.materials().values()]}

    def _kappa(self) -> Any:
        """Return kappa, or that of each solid or patch. Raises InputError."""
        if self.material is None:
            return by_patch("--kappa", self.kappa, _entries)
        return of_all({who: one.conductivity for who, one in self.materials().items()})

    def problem(self) -> Poisson:
        """Return the problem of these options. Raises InputError."""
        from solve import Poisson

        check_space(self.refine, self.degree)
        robin = {}
        for face, text in texts.faces("robin", self.robin).items():
            alpha, colon, g = (text or "").partition(":")
            if not alpha.strip():
                raise InputError(f"robin {face}: write {face}=ALPHA or {face}=ALPHA:FORMULA")
            robin[face] = (alpha, g if colon else None)
        with input_errors():
            problem = Poisson(
                exact=self.exact,
                source=by_patch("--source", self.source, str),
                boundary=self.boundary,
                kappa=self._kappa(),
                reaction=by_patch("--reaction", self.reaction, str),
                neumann=texts.faces("neumann", self.neumann),
                robin=robin,
                conditions=self.conditions(1),
            )
        self.asks(problem)
        return problem


def _entries(text: str) -> list[str]:
    return text.split(",")
