"""Reads volume meshes of other programs: their hexahedra and tetrahedra, linear and curved."""

from pathlib import Path

from parameterize.meshes.mesh import VolumeMesh
from parameterize.surface.errors import MeshError

from ..errors import InputError, input_errors
from ..type_check import check_type
from .abaqus_mesh import read_abaqus_mesh
from .exodus_mesh import read_exodus_mesh
from .gmsh_mesh import read_gmsh_mesh
from .vtk_mesh import read_vtk_mesh
from .words import text_of

EXODUS = (".e", ".exo", ".ex2")
ALWAYS = (".inp", *EXODUS, ".cgns")  # endings of volume meshes; the others may also hold surfaces
ENDINGS = (".msh", ".vtu", ".vtk", *ALWAYS)
MAX_BYTES = 4 << 30


def mesh_in(path: str | Path) -> VolumeMesh | None:
    """Return the mesh of a file that may also be a surface; None where it is one, or missing. Raises InputError."""
    source = Path(path)
    ending = source.suffix.lower()
    if ending in ALWAYS:
        return load_mesh(source)
    return find_mesh(source) if ending in ENDINGS and source.is_file() else None


def load_mesh(path: str | Path) -> VolumeMesh:
    """Return the volume mesh of a .msh, .inp, .vtu, .vtk, Exodus or CGNS file.

    Hexahedra and tetrahedra of the degrees 1 to 6 are read: Lagrange elements, hexahedra with 20 nodes, and Bezier
    cells of VTK. Other solid elements, such as wedges, are counted. Elements keep their numbers in the file; cells of
    VTK are numbered from 0.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    VolumeMesh
        With physical groups of volumes (.msh) and element sets (.inp) as groups.

    Raises
    ------
    InputError
        For another ending, a file that is missing or damaged, and one without hexahedra and tetrahedra.

    Examples
    --------
    >>> import iga_nn
    >>> try:
    ...     iga_nn.load_mesh("part.stl")
    ... except iga_nn.InputError as error:
    ...     print(error)
    part.stl: is no volume mesh: expected a name ending in one of .msh .vtu .vtk .inp .e .exo .ex2 .cgns
    """
    check_type("path", path, str | Path)
    source = Path(path)
    if source.suffix.lower() not in ENDINGS:
        raise InputError(f"{path}: is no volume mesh: expected a name ending in one of {' '.join(ENDINGS)}")
    found = find_mesh(source)
    if found is None:
        raise InputError(f"{path}: holds no solid elements: give a mesh of hexahedra or tetrahedra")
    return found


def find_mesh(source: Path) -> VolumeMesh | None:
    """Return the solid elements of a file, None where it has none, such as one with a surface. Raises InputError."""
    try:
        with input_errors():
            if source.stat().st_size > MAX_BYTES:
                raise ValueError(f"{source}: has more than {MAX_BYTES >> 30} GiB: give a part of the mesh")
        return _read(source)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{source}: {error.strerror}") from None
    except (MeshError, ValueError) as error:
        raise InputError(f"{source}: {error}") from None


def _read(source: Path) -> VolumeMesh | None:
    ending = source.suffix.lower()
    if ending == ".msh":
        return read_gmsh_mesh(source.read_bytes())
    if ending == ".inp":
        return read_abaqus_mesh(text_of(source))
    return read_exodus_mesh(source) if ending in EXODUS else read_vtk_mesh(source)
