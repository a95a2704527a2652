"""Writes the facts of `check` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from parameterize.arrays import listed

if TYPE_CHECKING:
    from parameterize.meshes.certify import MeshCertificate

MOST_SHOWN = 40  # entries of a list


def surface_in_words(facts: dict[str, Any]) -> str:
    """Return the facts of `check` about a surface as text: first a line for each region, last the groups."""
    others = {key: value for key, value in facts.items() if key not in ("groups", "regions")}
    groups = [f"{'group:':16s} {_group(found)}" for found in facts["groups"]]
    regions = [f"{'region:':16s} {_region(found)}" for found in facts.get("regions", ())]
    return "\n".join([*regions, facts_in_words(others), *groups])


def _group(found: dict[str, Any]) -> str:
    shape = f": {found['shape']}" if "shape" in found else ""
    return f"{found['name']}, {found['faces']} faces, area {found['area']:.6g}{shape}"


def _region(found: dict[str, Any]) -> str:
    count = "1 triangle" if found["triangles"] == 1 else f"{found['triangles']} triangles"
    return f"{found['region']}, area {found['area']:.6g}, {found['share']:.2%} of the surface, {count}"


def mesh_in_words(found: MeshCertificate) -> str:
    """Return the certificate of a volume mesh as text, the verdicts first."""
    overlap = found.overlap
    said = {False: "none, proved", True: f"YES: {overlap.reason}", None: f"not decided: {overlap.reason}"}
    kinds = {**found.mesh.counts, **{f"{kind} (not checked)": count for kind, count in found.mesh.unchecked.items()}}
    facts: dict[str, Any] = {
        "det J > 0" if found.orientation == "right-handed" else "det J < 0": found.verdict,
        "overlap": said[overlap.overlap],
        "one-to-one": found.one_to_one,
        "elements": ", ".join(f"{count} {kind}" for kind, count in kinds.items()),
        "nodes": len(found.mesh.points),
    }
    lines = [facts_in_words(facts), *(f"{'defect:':16s} {line}" for line in found.defects)]
    rest: dict[str, Any] = {"worst": str(found.worst)}
    if found.verdict == "certified":
        rest["scaled Jacobian"] = f">= {found.scaled_jacobian:.4g}"
    if overlap.touching:
        rest["touching"] = f"{overlap.touching} pairs of faces in the same place have different nodes: not glued"
    return "\n".join([*lines, facts_in_words(rest | {"volume": found.volume})])


def facts_in_words(facts: dict[str, Any]) -> str:
    """Return the facts of `check` as text, one a line."""
    return "\n".join(f"{key + ':':16s} {_text(value)}" for key, value in facts.items())


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return "; ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return listed([_text(item) for item in value], MOST_SHOWN) or "none"
    return str(value)
