"""Namespaces of 3MF: extensions with which the triangles stay the body, and those that make another body.

(3MF Consortium, "Core Specification" 1.3, 2.3.1 and 3.4, and the specifications of its extensions.)
"""

from ..errors import MeshError

MICROSOFT = "http://schemas.microsoft.com/3dmanufacturing"
CORE = f"{MICROSOFT}/core/2015/02"
PRODUCTION = f"{MICROSOFT}/production/2015/06"
ALTERNATIVES = f"{MICROSOFT}/production/alternatives/2021/04"
SLICE = f"{MICROSOFT}/slice/2015/07"
TRIANGLE_SETS = f"{MICROSOFT}/trianglesets/2021/07"

# A file may require these.
READ = (
    CORE,
    PRODUCTION,  # objects in other parts of the package: read
    ALTERNATIVES,  # a mesh that another one is to replace is refused where it is built
    SLICE,  # the same; other slices are cut from the mesh
    TRIANGLE_SETS,  # read as groups
    f"{MICROSOFT}/material/2015/02",  # colours, textures and mixtures of materials, on the same triangles
)
# What stands after "3dmanufacturing/" in namespaces of extensions, of any year, with which the mesh is not the body.
OTHER_BODIES = {
    "beamlattice": "beam lattices",
    "booleanoperations": "boolean operations",
    "displacement": "displacement maps",
    "implicit": "implicit functions",
    "mirroring": "mirrored meshes",
    "volumetric": "volumetric data",
    "securecontent": "encrypted parts",
}
# Elements of these that leave the mesh as it is: fields of colours and materials inside of it.
FIELDS = ("volumedata",)


def name_of(namespace: str) -> str:
    """Return the words by which messages name an extension, with its namespace."""
    words = OTHER_BODIES.get(_family(namespace), "")
    return f"{words} ({namespace[:100]})" if words else repr(namespace[:100])


def makes_another_body(tag: str) -> bool:
    """Return whether an element or attribute "{namespace}name" says that the mesh of an object is not its shape."""
    namespace, _, name = tag[1:].rpartition("}")
    return _family(namespace) in OTHER_BODIES and name not in FIELDS


def check_required(prefixes: str, namespaces: dict[str, str]) -> None:
    """Raise MeshError where a model requires an extension that is not read.

    prefixes: the words of its requiredextensions. namespaces: by the prefixes that its root element declares.
    """
    for prefix in prefixes.split():
        namespace = namespaces.get(prefix)
        if namespace is None:
            raise MeshError(
                f"the 3MF requires the extension {prefix[:40]!r}, which it does not declare: export it again"
            )
        if namespace not in READ:
            raise MeshError(f"the 3MF requires an extension that is not read, {name_of(namespace)}: export it without")


def _family(namespace: str) -> str:
    return namespace.partition("/3dmanufacturing/")[2].partition("/")[0]
