"""What a STEP file has beside its shapes: annotations and geometry of which OpenCASCADE makes no shape, by its text.

Representations and their items: ISO 10303-43, shapes ISO 10303-42, annotations ISO 10303-46.
"""

import re
from collections import Counter

# Of whose items shapes are made.
SHAPES = re.compile(
    rb"\b(?:\w*SHAPE_REPRESENTATION|CONSTRUCTIVE_GEOMETRY_REPRESENTATION)\s*\(\s*(?:'[^']{0,400}+')+\s*,\s*\(([^()]*+)\)"
)
NUMBER = re.compile(rb"#(\d{1,18})")
TYPE = re.compile(rb"#(\d{1,18})\s*=\s*\(?\s*(\w{1,80}+)\s*\(")  # of a complex entity, the first of its types
ANNOTATION = re.compile(rb"=\s*\(?\s*(?:DRAUGHTING_|TESSELLATED_)?ANNOTATION_(?:\w{1,40}_)?OCCURRENCE\s*\(")
KINDS = (
    (re.compile(r"\w*_CURVE(_WITH_KNOTS)?|LINE|POLYLINE|CIRCLE|ELLIPSE|PARABOLA|HYPERBOLA"), "curve"),
    (re.compile(r"\w*_SURFACE(_WITH_KNOTS)?|PLANE"), "surface without an outline"),
    (re.compile(r"CARTESIAN_POINT|POINT_ON_CURVE|POINT_ON_SURFACE"), "point"),
    (re.compile(r"OPEN_SHELL|CLOSED_SHELL|ADVANCED_FACE|FACE_SURFACE"), "loose shell"),
)


def beside(data: bytes) -> Counter[str]:
    """Return the numbers of annotations, and of items by their kind, that OpenCASCADE passes over in a STEP file."""
    named = {int(number[1]) for items in SHAPES.finditer(data) for number in NUMBER.finditer(items[1])}
    types = {int(found[1]): found[2].decode() for found in TYPE.finditer(data) if int(found[1]) in named}
    found: Counter[str] = Counter()
    for name in types.values():
        found.update(kind for pattern, kind in KINDS if pattern.fullmatch(name))
    found["annotation"] = len(ANNOTATION.findall(data))
    return +found
