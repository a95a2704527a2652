"""Parts of a mesh that slicers note in files of their own as no material: cuts, modifiers, places for supports.

PrusaSlicer writes them into the mesh of the part, Bambu Studio and OrcaSlicer as components, so that the triangles
alone are another body.
"""

from ..errors import MeshError
from .threemf_package import Package, Xml, parse

NOTES = ("/Metadata/Slic3r_PE_model.config", "/Metadata/model_settings.config")
MATERIAL = ("ModelPart", "normal_part")


def check_notes(package: Package) -> None:
    """Raise MeshError where a slicer's notes name a part of a mesh that is no material."""
    for part in NOTES:
        if package.has(part):
            parse(package.read(part), _Notes())


class _Notes(Xml):
    def start(self, tag: str, given: dict[str, str]) -> None:
        kind = MATERIAL[0]
        if tag == "part":
            kind = given.get("subtype", kind)
        elif tag == "metadata" and given.get("key") == "volume_type":
            kind = given.get("value", kind)
        if kind not in MATERIAL:
            raise MeshError(
                f"a slicer marks a part of the 3MF as {kind[:40]!r}, which is no material: delete it there, "
                "or apply it, and export the part again"
            )
