"""Holds the library of materials: numbers at room temperature, as they are commonly quoted for the sources named.

They were not read from these sources. Units are mm, N, MPa, t/mm^3, W/(mm K) and 1/K. A grade of one's own differs: its
data sheet counts.
"""

from .material import Material, find

QUOTED = "values as they are commonly quoted for these sources; check them for your grade before you rely on them"
WOOD = "Wood Handbook, FPL-GTR-282 (2021), ch. 4 and 5, at 12 % moisture; axes along fibre, radius, tangent"
WWFE = "Soden, Hinton, Kaddour, Compos. Sci. Technol. 58 (1998) 1011; axis 1 along the fibres"

MATERIALS = (
    Material(
        "steel",
        young=210000.0,
        poisson_ratio=0.3,
        density=7.85e-9,
        expansion=12e-6,
        conductivity=0.0533,
        yield_strength=235.0,
        source="S235: EN 1993-1-1, EN 1991-1-1, EN 1993-1-2, EN 10025-2 (t <= 16 mm)",
        other_names=("structural steel", "S235"),
    ),
    Material(
        "stainless",
        young=200000.0,
        poisson_ratio=0.3,
        density=7.9e-9,
        expansion=16e-6,
        conductivity=0.015,
        yield_strength=210.0,
        source="1.4301 (AISI 304): EN 10088-1, EN 10088-2 (hot rolled plate), EN 1993-1-4",
        other_names=("stainless steel", "304", "1.4301"),
    ),
    Material(
        "cast iron",
        young=110000.0,
        poisson_ratio=0.26,
        density=7.2e-9,
        expansion=11.7e-6,
        conductivity=0.0485,
        yield_strength=165.0,
        source="EN-GJL-250: EN 1561, annex; 0.1 % proof stress, brittle",
        other_names=("EN-GJL-250", "grey iron"),
    ),
    Material(
        "aluminium",
        young=68900.0,
        poisson_ratio=0.33,
        density=2.7e-9,
        expansion=23.6e-6,
        conductivity=0.167,
        yield_strength=276.0,
        source="6061-T6: ASM Metals Handbook, vol. 2",
        other_names=("aluminum", "6061", "6061-T6", "aluminium 6061-T6"),
    ),
    Material(
        "titanium",
        young=113800.0,
        poisson_ratio=0.342,
        density=4.43e-9,
        expansion=8.6e-6,
        conductivity=0.0067,
        yield_strength=880.0,
        source="Ti-6Al-4V annealed: ASM Metals Handbook, vol. 2; yield strengths from 830 MPa on are quoted",
        other_names=("Ti-6Al-4V", "titanium Ti-6Al-4V"),
    ),
    Material(
        "copper",
        young=117000.0,
        poisson_ratio=0.34,
        density=8.89e-9,
        expansion=17e-6,
        conductivity=0.391,
        yield_strength=69.0,
        source="C11000 annealed: Copper Development Association",
        other_names=("C11000",),
    ),
    Material(
        "brass",
        young=97000.0,
        poisson_ratio=0.31,
        density=8.49e-9,
        expansion=20.5e-6,
        conductivity=0.115,
        yield_strength=124.0,
        source="C36000 annealed: Copper Development Association",
        other_names=("C36000",),
    ),
    Material(
        "magnesium",
        young=45000.0,
        poisson_ratio=0.35,
        density=1.77e-9,
        expansion=26e-6,
        conductivity=0.096,
        yield_strength=200.0,
        source="AZ31B-F extruded: ASM Metals Handbook, vol. 2",
        other_names=("AZ31B",),
    ),
    Material(
        "concrete",
        young=33000.0,
        poisson_ratio=0.2,
        density=2.4e-9,
        expansion=10e-6,
        conductivity=0.00136,
        source="C30/37: EN 1992-1-1, EN 1991-1-1, EN 1992-1-2 (lower limit); it cracks before it yields",
        other_names=("C30/37",),
    ),
    Material(
        "glass",
        young=70000.0,
        poisson_ratio=0.2,
        density=2.5e-9,
        expansion=9e-6,
        conductivity=0.001,
        source="soda-lime float glass: EN 572-1; brittle",
        other_names=("soda-lime glass", "float glass"),
    ),
    Material(
        "ABS",
        young=2300.0,
        poisson_ratio=0.35,
        density=1.05e-9,
        expansion=90e-6,
        conductivity=0.00017,
        yield_strength=45.0,
        source="general-purpose grades at 23 degrees: typical of data sheets (ISO 527), which differ by 20 %",
    ),
    Material(
        "PA66",
        young=3100.0,
        poisson_ratio=0.41,
        density=1.14e-9,
        expansion=100e-6,
        conductivity=0.00025,
        yield_strength=82.0,
        source="nylon 66 dry as moulded at 23 degrees: data sheet of Zytel 101L; conditioned it has E = 1400 MPa",
        other_names=("nylon", "nylon PA66", "polyamide"),
    ),
    Material(
        "PEEK",
        young=4000.0,
        poisson_ratio=0.4,
        density=1.3e-9,
        expansion=45e-6,
        conductivity=0.00032,
        yield_strength=98.0,
        source="unfilled at 23 degrees: data sheet of Victrex PEEK 450G",
    ),
    Material(
        "rubber",
        young=1.8,
        poisson_ratio=0.4997,
        density=0.95e-9,
        expansion=220e-6,
        conductivity=0.00014,
        source="natural rubber of 45 IRHD, small strains: Lindley, Engineering Design with Natural Rubber",
        other_names=("natural rubber",),
    ),
    Material(
        "spruce",
        young=(11900.0, 928.0, 512.0),
        poisson_ratio=(0.372, 0.467, 0.435),
        shear_modulus=(762.0, 726.0, 36.0),
        density=0.45e-9,
        expansion=(4e-6, 23.5e-6, 32e-6),
        conductivity=(0.00021, 0.000116, 0.000116),
        source=f"Sitka spruce: {WOOD}",
        other_names=("wood", "Sitka spruce"),
    ),
    Material(
        "CFRP",
        young=(126000.0, 11000.0, 11000.0),
        poisson_ratio=(0.28, 0.28, 0.4),
        shear_modulus=(6600.0, 6600.0, 3930.0),
        density=1.58e-9,
        expansion=(-1e-6, 26e-6, 26e-6),
        source=f"AS4/3501-6, unidirectional, 60 % fibres: {WWFE}; E1 is quoted as 126 to 148 GPa, this is the least",
        other_names=("CFRP UD", "carbon fibre", "AS4/3501-6"),
    ),
    Material(
        "GFRP",
        young=(45600.0, 16200.0, 16200.0),
        poisson_ratio=(0.278, 0.278, 0.4),
        shear_modulus=(5830.0, 5830.0, 5785.0),
        density=2.0e-9,
        expansion=(8.6e-6, 26.4e-6, 26.4e-6),
        source=f"E-glass/MY750, unidirectional, 60 % fibres: {WWFE}",
        other_names=("GFRP UD", "glass fibre"),
    ),
)


def material(name: str) -> Material:
    """Return a material of the library by its name, such as "steel", in mm, N, MPa and t/mm^3.

    Its numbers are those commonly quoted for the source it names; check them for your grade before you rely on them.

    Parameters
    ----------
    name : str
        A name of `iga-nn materials`, in any case of letters.

    Raises
    ------
    ValueError
        For a name that the library does not have.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.material("Ti-6Al-4V").name
    'titanium'
    """
    return find(name, MATERIALS)
