"""STEP files written as text, without OpenCASCADE: plane bodies, what may stand beside them, units, assemblies."""

from __future__ import annotations

import numpy as np

BOX = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]  # seen from outside
MILLIMETRE = "(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))"
FRAME = ((0, 0, 0), (0, 0, 1), (1, 0, 0))  # origin, z, x


def numbers(values):
    return listed(real(value) for value in values)


def real(value):
    text = repr(float(value)).upper()
    return text if "." in text else text.replace("E", ".E")


def converted(name, factor, base=(MILLIMETRE,)):
    """A unit of so many of another one, as `units` takes it."""
    size = f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({real(factor)}),%s)"
    return (*base, size, f"(CONVERSION_BASED_UNIT('{name}',%s) LENGTH_UNIT() NAMED_UNIT(#1))")


def metric(prefix=""):
    return (f"(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT({f'.{prefix}.' if prefix else '$'},.METRE.))",)


def listed(names):
    return "(" + ",".join(names) + ")"


class Step:
    """The entities of a STEP file; each method adds some and returns the name of the last, such as #12."""

    def __init__(self, *lengths):
        self.rows = ["#1=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);"]
        self.context = self.units(*lengths or (MILLIMETRE,))

    def add(self, text):
        self.rows.append(f"#{len(self.rows) + 1}={text};")
        return f"#{len(self.rows)}"

    def units(self, *lengths):
        """A context of lengths in the last of these units, each as text where %s is the name of the one before."""
        name = ""
        for text in lengths:
            name = self.add(text.replace("%s", name))
        angle = self.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))")
        solid = self.add("(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())")
        close = self.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{name},'distance_accuracy_value','')")
        return self.add(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({close})) "
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({name},{angle},{solid})) REPRESENTATION_CONTEXT('','3D'))"
        )

    def point(self, place):
        return self.add(f"CARTESIAN_POINT('',{numbers(place)})")

    def direction(self, towards):
        return self.add(f"DIRECTION('',{numbers(np.asarray(towards) / np.linalg.norm(towards))})")

    def placement(self, frame=FRAME):
        origin, z, x = frame
        return self.add(f"AXIS2_PLACEMENT_3D('',{self.point(origin)},{self.direction(z)},{self.direction(x)})")

    def line(self, start, end):
        vector = self.add(f"VECTOR('',{self.direction(np.subtract(end, start))},1.)")
        return self.add(f"LINE('',{self.point(start)},{vector})")

    def segment(self, start, end):
        ends = [self.point(place) for place in (start, end)]
        return self.add(f"TRIMMED_CURVE('',{self.line(start, end)},({ends[0]}),({ends[1]}),.T.,.CARTESIAN.)")

    def faces(self, points, polygons):
        """The plane faces of polygons that are seen from outside, with common edges."""
        points = np.asarray(points, dtype=float)
        corners = [self.add(f"VERTEX_POINT('',{self.point(place)})") for place in points]
        edges, found = {}, []
        for polygon in polygons:
            around = []
            for a, b in zip(polygon, [*polygon[1:], polygon[0]], strict=True):
                if (b, a) not in edges and (a, b) not in edges:
                    line = self.line(points[a], points[b])
                    edges[a, b] = self.add(f"EDGE_CURVE('',{corners[a]},{corners[b]},{line},.T.)")
                edge, sense = (edges[a, b], "T") if (a, b) in edges else (edges[b, a], "F")
                around.append(self.add(f"ORIENTED_EDGE('',*,*,{edge},.{sense}.)"))
            loop = self.add(f"EDGE_LOOP('',{listed(around)})")
            bound = self.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
            first, second, last = points[polygon[0]], points[polygon[1]], points[polygon[-1]]
            normal = np.cross(second - first, last - first)
            plane = self.add(f"PLANE('',{self.placement((first, normal, second - first))})")
            found.append(self.add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
        return found

    def shell(self, points, polygons=SIDES, kind="CLOSED"):
        return self.add(f"{kind}_SHELL('',{listed(self.faces(points, polygons))})")

    def box(self, size=(1, 2, 3), low=(0, 0, 0), name=""):
        """A solid."""
        return self.add(f"MANIFOLD_SOLID_BREP('{name}',{self.shell(BOX * size + low)})")

    def loose(self, low=(0, 0, 9)):
        """A face of 1 x 1 that bounds nothing, as an open shell."""
        return self.shell(BOX[:4] + low, SIDES[:1], "OPEN")

    def representation(self, items, kind="ADVANCED_BREP_SHAPE_REPRESENTATION", context=None):
        return self.add(f"{kind}('',{listed(items)},{context or self.context})")

    def product(self, name, representation):
        """A product of that shape; returns its definition."""
        context = self.add("APPLICATION_CONTEXT('managed model based 3d engineering')")
        inside = self.add(f"PRODUCT_CONTEXT('',{context},'mechanical')")
        product = self.add(f"PRODUCT('{name}','{name}','',({inside}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        stage = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{context},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('design','',{formation},{stage})")
        shape = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{representation})")
        return definition

    def beside(self, first, second, kind="SHAPE_REPRESENTATION_RELATIONSHIP"):
        return self.add(f"{kind}('','',{first},{second})")

    def part(self, *items, name="part", **options):
        """A product of these items."""
        frame = self.placement()
        representation = self.representation([frame, *items], **options)
        return self.product(name, representation), representation, frame

    def assembly(self, *placed, name="assembly"):
        """A product of parts, each in a frame: pairs of `part` and frame."""
        frames = [self.placement(frame) for _, frame in placed]
        origin = self.placement()
        whole = self.representation([origin, *frames], "SHAPE_REPRESENTATION")
        definition = self.product(name, whole)
        for (part, _), frame in zip(placed, frames, strict=True):
            self.use(part, definition, whole, self.add(f"ITEM_DEFINED_TRANSFORMATION('','',{part[2]},{frame})"))
        return definition, whole, origin

    def use(self, part, definition, whole, moved):
        """Put a part into a product of that definition and shape, moved in that way."""
        piece, shape, _ = part
        use = self.add(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','','',{definition},{piece},$)")
        of_use = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
        relation = self.add(
            f"(REPRESENTATION_RELATIONSHIP('','',{shape},{whole}) "
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved}) SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        self.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{of_use})")

    def composite(self):
        """A curve of two segments."""
        places = ((5, 5, 5), (6, 6, 6), (7, 5, 5))
        lines = [self.segment(*ends) for ends in zip(places, places[1:], strict=False)]
        pieces = [self.add(f"COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,{line})") for line in lines]
        return self.add(f"COMPOSITE_CURVE('',{listed(pieces)},.F.)")

    def set_of(self, *items, kind="GEOMETRIC_SET"):
        return self.add(f"{kind}('',{listed(items)})")

    def surfaces(self, *shells):
        return self.add(f"SHELL_BASED_SURFACE_MODEL('',{listed(shells)})")

    def mesh(self, kind="SOLID"):
        """The triangles of a box of 1 x 2 x 3: a SOLID or SHELL of faces."""
        rows = ",".join(numbers(place) for place in BOX * (1, 2, 3))
        places = self.add(f"COORDINATES_LIST('',8,({rows}))")
        faces = []
        for a, b, c, d in np.array(SIDES) + 1:
            faces.append(self.add(f"TRIANGULATED_FACE('',{places},8,(),$,(),(({a},{b},{c}),({a},{c},{d})))"))
        return self.add(f"TESSELLATED_{kind}('',{listed(faces)},$)")

    def styled(self, item, kind="STYLED_ITEM"):
        """A red item, or an annotation of it."""
        red = self.add("COLOUR_RGB('',1.,0.,0.)")
        font = self.add("DRAUGHTING_PRE_DEFINED_CURVE_FONT('continuous')")
        style = self.add(f"CURVE_STYLE('',{font},POSITIVE_LENGTH_MEASURE(0.1),{red})")
        assigned = self.add(f"PRESENTATION_STYLE_ASSIGNMENT(({style}))")
        return self.add(f"{kind}('',({assigned}),{item})")

    def note(self):
        """An annotation with its callout."""
        drawn = self.set_of(self.segment((0, 0, 4), (1, 1, 5)), kind="GEOMETRIC_CURVE_SET")
        occurrence = self.styled(drawn, "ANNOTATION_CURVE_OCCURRENCE")
        callout = self.add(f"DRAUGHTING_CALLOUT('note',({occurrence}))")
        return self.representation([callout], "DRAUGHTING_MODEL")

    def data(self):
        """The bytes of the file."""
        schema = "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
        head = ("HEADER;", "FILE_DESCRIPTION((''),'2;1');", "FILE_NAME('','',(''),(''),'','','');")
        rows = ["ISO-10303-21;", *head, f"FILE_SCHEMA(('{schema}'));", "ENDSEC;", "DATA;"]
        return "\n".join([*rows, *self.rows, "ENDSEC;", "END-ISO-10303-21;", ""]).encode()


def solid_and(make):
    """A box of 1 x 2 x 3, and the item that `make` adds to the file, in the same representation."""
    step = Step()
    step.part(step.box(), make(step))
    return step.data()


def solid_beside(make, kind, relation="SHAPE_REPRESENTATION_RELATIONSHIP"):
    """The same, where the item has a representation of its own beside that of the box."""
    step = Step()
    _, shape, _ = step.part(step.box())
    step.beside(step.representation([make(step)], kind), shape, relation)
    return step.data()


def with_a_mesh(kind="SOLID", exact=True):
    """A box of 1 x 2 x 3 as a mesh, beside the exact one or alone."""
    step = Step()
    mesh = step.mesh(kind)
    if not exact:
        step.part(mesh, kind="TESSELLATED_SHAPE_REPRESENTATION")
        return step.data()
    _, shape, _ = step.part(step.box())
    step.beside(step.representation([mesh], "TESSELLATED_SHAPE_REPRESENTATION"), shape)
    return step.data()


def placed(target, *operator):
    """A box of 1 x 2 x 3 in another shape, as a mapped item or by a relation: origin, three axes, scale."""
    step = Step()
    frame = step.placement()
    shape = step.representation([frame, step.box()])
    origin, first, second, third, scale = operator
    axes = [step.direction(axis) for axis in (first, second, third)]
    moved = step.add(
        f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',{axes[0]},{axes[1]},{step.point(origin)},{scale},{axes[2]})"
    )
    if target == "map":
        source = step.add(f"REPRESENTATION_MAP({frame},{shape})")
        step.part(step.add(f"MAPPED_ITEM('',{source},{moved})"), kind="SHAPE_REPRESENTATION", name="whole")
    else:
        whole = step.representation([step.placement()], "SHAPE_REPRESENTATION")
        part = step.product("part", shape), shape, frame
        step.use(part, step.product("whole", whole), whole, moved)
    return step.data()


def crowded(solids=1):
    """An assembly of a part with a face, a mesh and a note; also of a second one of it, and of one in another unit."""
    step = Step(*converted("INCH", 25.4))
    step.note()
    bolt = step.part(step.box(), step.surfaces(step.loose()), name="bolt")
    step.beside(step.representation([step.mesh("SHELL")], "TESSELLATED_SHAPE_REPRESENTATION"), bolt[1])
    nut = step.part(step.box(low=(3, 0, 0)), name="nut", context=step.units(*metric("CENTI"))) if solids > 2 else None
    places = [(bolt, FRAME), (bolt, ((9, 0, 0), (0, 1, 0), (0, 0, 1))), (nut, FRAME)]
    step.assembly(*places[:solids])
    return step.data()
