"""Extensions of glTF: which are read, which leave the triangles as they are, and what becomes of all others.

(Khronos, "glTF 2.0 Extension Registry". A file lists those without which it is not understood as required.)
"""

from typing import Any

from ..errors import MeshError

INSTANCES, VISIBILITY, LEVELS = "EXT_mesh_gpu_instancing", "KHR_node_visibility", "MSFT_lod"
READ = (INSTANCES, VISIBILITY, LEVELS, "KHR_mesh_quantization", "KHR_accessor_float64")
# A primitive or a buffer view names the one that holds its arrays; plain arrays may stand beside it.
COMPRESSED = (
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "MESHOPT_compression",
)
LOOKS = (  # materials, textures and lights say how triangles look, not where they are
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "ADOBE_materials_clearcoat_specular",
    "ADOBE_materials_clearcoat_tint",
    "ADOBE_materials_thin_transparency",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
    "NV_materials_mdl",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "MSFT_texture_dds",
    "KHR_lights_punctual",
    "EXT_lights_ies",
    "EXT_lights_image_based",
)
METADATA = (  # data about the model, and what a user may point at
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "AGI_stk_metadata",
    "FB_geometry_metadata",
    "GODOT_single_root",
)
REPEATED = (  # triangles or edges of the same primitives once more, and animations, which have a notice of their own
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_restart",
    "CESIUM_primitive_outline",
    "KHR_animation_pointer",
)
KNOWN = frozenset((*READ, *LOOKS, *METADATA, *REPEATED))


def unread(document: dict[str, Any]) -> tuple[str, ...]:
    """Return a notice for each extension that a glTF uses and that might change its triangles, but is not read.

    Raises MeshError where the file requires one that is not read.
    """
    required = [name for name in document.get("extensionsRequired", []) if name not in KNOWN]
    for name in required:
        if name in COMPRESSED:
            raise MeshError(f"compressed by {name}, which is not read: save it without compression")
        raise MeshError(f"requires the extension {name!r:.60}, which is not read: export it without this extension")
    used = [name for name in dict.fromkeys(document.get("extensionsUsed", [])) if name not in KNOWN]
    return tuple(
        f"read the plain arrays beside those that {name} compresses"
        if name in COMPRESSED
        else f"left out the extension {name!r:.60}, which the file uses and does not require"
        for name in used
    )


def compression_of(thing: dict[str, Any]) -> str:
    """Return the extension that compresses a primitive or a buffer view, "" where it has only plain arrays."""
    return next((name for name in COMPRESSED if name in thing.get("extensions", {})), "")


def extension(thing: dict[str, Any], name: str) -> dict[str, Any]:
    """Return what an extension says of a node, nothing where it has none."""
    return thing.get("extensions", {}).get(name, {})
