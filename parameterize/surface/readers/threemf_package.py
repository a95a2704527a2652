"""The package of a 3MF: its parts by their names, and the part that is the model by the package's relationships.

(ISO/IEC 29500-2, "Open Packaging Conventions"; 3MF Consortium, "Core Specification" 1.3, 2.1; "Secure Content" 1.0.)
"""

import posixpath
from urllib.parse import unquote
from xml.etree import ElementTree

from ..errors import MeshError
from .common import DAMAGED
from .zip_file import Archive

RELATIONSHIPS = "/_rels/.rels"
RELATIONSHIP = "{http://schemas.openxmlformats.org/package/2006/relationships}Relationship"
MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"  # the type of the relationship to the model
ENCRYPTED = b"%3McF"  # an encrypted part begins with it
# Of slicers: files in which they note parts of a mesh that are no material: cuts, modifiers, places for supports.
# PrusaSlicer writes these parts into the mesh, Bambu Studio and OrcaSlicer as components: the triangles alone are
# another body.
NOTES = ("/Metadata/Slic3r_PE_model.config", "/Metadata/model_settings.config")
MATERIAL = ("ModelPart", "normal_part")


class Xml:
    """A target of `parse` that keeps nothing; others extend it."""

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Refuse a document type, whose entities might grow without bound; the specification has none."""
        raise MeshError("the 3MF declares a document type, whose entities are not expanded: export it again")

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Take the beginning of an element, "{namespace}name", and its attributes."""


def parse(data: bytes, target: Xml) -> None:
    """Give the elements of an XML part to a target, in the encoding that the part declares."""
    parser = ElementTree.XMLParser(target=target)  # noqa: S314 - `Xml.doctype` refuses what declares entities
    try:
        parser.feed(data)
        parser.close()
    except MeshError:
        raise
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise MeshError(f"not readable as 3MF ({error}); {DAMAGED}") from None


class _Models(Xml):
    """The relationships to models: `inside`, names of parts, and `outside`, addresses of other files."""

    def __init__(self) -> None:
        self.inside: list[str] = []
        self.outside: list[str] = []

    def start(self, tag: str, given: dict[str, str]) -> None:
        if tag == RELATIONSHIP and given.get("Type") == MODEL:
            external = given.get("TargetMode", "Internal") != "Internal"
            (self.outside if external else self.inside).append(given.get("Target", ""))


class Package:
    """The parts of an archive by their names."""

    def __init__(self, archive: Archive) -> None:
        self._archive = archive
        self._members: dict[str, list[str]] = {}
        for member in archive.names:
            self._members.setdefault(_part_name(member), []).append(member)

    def has(self, reference: str) -> bool:
        """Return whether there is a part of this name."""
        return _part_name(reference) in self._members

    def find(self, reference: str) -> str:
        """Return the member of the archive that a reference from the root names, the same for each way to write it."""
        found = self._members.get(_part_name(reference), [])
        if len(found) != 1:
            raise MeshError(f"the 3MF has {len(found) or 'no'} parts named {reference!r:.80}, it needs one; {DAMAGED}")
        return found[0]

    def read(self, reference: str) -> bytes:
        """Return the content of a part. Raises MeshError for one that is missing, there twice, or encrypted."""
        data = self._archive.read(self.find(reference))
        if data.startswith(ENCRYPTED):
            raise MeshError(f"the part {reference!r:.80} of the 3MF is encrypted (secure content): export it without")
        return data

    def model(self) -> tuple[str, tuple[str, ...]]:
        """Return the member that is the model, and a notice where no relationship names it."""
        if not self.has(RELATIONSHIPS):
            return self._only_model()
        models = _Models()
        parse(self.read(RELATIONSHIPS), models)
        if models.outside:
            raise MeshError(f"the model of the 3MF is outside of it, {models.outside[0]!r:.80}: export it again")
        targets = {_part_name(target): target for target in models.inside}
        if len(targets) != 1:
            held = f"{len(targets)} 3D models ({', '.join(targets.values()):.200})" if targets else "no 3D model"
            raise MeshError(f"the archive has {held} by {RELATIONSHIPS}, a 3MF needs one: export it as 3MF again")
        return self.find(*targets.values()), ()

    def _only_model(self) -> tuple[str, tuple[str, ...]]:
        names = [member for member in self._archive.names if member.lower().endswith(".model")]
        if len(names) != 1:
            held = f"{len(names)} parts that might be one" if names else "no .model"
            raise MeshError(f"the archive has no 3D model: no {RELATIONSHIPS} and {held}; export it as 3MF again")
        return names[0], (f"the 3MF has no {RELATIONSHIPS}: read its only model, {names[0]!r:.80}",)


def _part_name(reference: str) -> str:
    """Return the name of a part as all references to it have it: from the root, decoded, in lower case.

    Names of parts are equal whatever their case. Relative references are those of the package's root.
    """
    return posixpath.normpath("/" + unquote(reference).lstrip("/")).lower()


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
