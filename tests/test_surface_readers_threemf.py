"""3MF: the model that the package names, what is built of it, and what is refused by its name."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass

import numpy as np
import pytest
from threemf_files import CONSORTIUM, MICROSOFT, PIECES, archive, group, mesh, model, package, relationships, thing

from parameterize.surface.errors import MeshError
from parameterize.surface.readers.file import RawMesh, read_mesh
from parameterize.surface.surface import load_surface

OTHER = model(thing(content=mesh((10, 20, 30))))  # 6000, where 6 is right
HALF_TURN = "-1 0 0 0 -1 0 0 0 1 0 0 0"  # about z
SHIFT = "1 0 0 0 1 0 0 0 1 10 20 30"


@dataclass
class Read:
    """What a file gives before it is mended; volume: with its sign, bbox: (2, 3)."""

    raw: RawMesh

    def __getattr__(self, name):
        return getattr(self.raw, name)

    @property
    def volume(self):
        return np.linalg.det(self.raw.vertices[self.raw.faces]).sum() / 6.0

    @property
    def bbox(self):
        return np.array([self.raw.vertices.min(axis=0), self.raw.vertices.max(axis=0)])


@pytest.fixture
def read(tmp_path):
    def surface(content, max_faces=1000):
        path = tmp_path / "part.3mf"
        path.write_bytes(content)
        return Read(read_mesh(path, max_faces))

    return surface


@pytest.fixture
def refused(read):
    def message(content):
        with pytest.raises(MeshError) as caught:
            read(content)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return message


@pytest.mark.parametrize(
    ("target", "member"),
    [
        ("/3D/new.model", "3D/new.model"),
        ("3D/new.model", "3D/new.model"),  # from the root of the package
        ("/3D/./deep/../new.model", "3D/new.model"),
        ("/3d/NEW.model", "3D/new.MODEL"),  # names of parts are equal whatever their case
        ("/3D/my%20part.model", "3D/my part.model"),
        ("/3D/k%C3%B6rper.model", "3D/k\xf6rper.model"),
        ("/3D/k%C3%B6rper.model", "3D/k%C3%B6rper.model"),
        ("/root.xml", "root.xml"),
    ],
)
def test_the_model_is_the_part_that_the_package_names(target, member, read):
    parts = {"_rels/.rels": relationships(target), "3D/3dmodel.model": OTHER, member: model()}
    for members in (parts, dict(reversed(parts.items()))):
        surface = read(archive(members))
        assert surface.volume == pytest.approx(6.0) and surface.notices == ()
    assert read(archive({**parts, member: OTHER})).volume == pytest.approx(6000.0)


def test_other_relationships_are_no_models(read):
    """A thumbnail, one to a file on the web, and one of another namespace."""
    texts = relationships("/a.png", "/b.png").split("<Relationship ")
    picture = texts[1].replace("3dmanufacturing/2013/01/3dmodel", "metadata/thumbnail")
    web = texts[2].replace("3dmanufacturing/2013/01/3dmodel", "link").replace(" />", ' TargetMode="External"/>')
    mine = '<y:Relationship xmlns:y="urn:y" Type="{}" Target="/c.model"/>'.format(f"{MICROSOFT}/2013/01/3dmodel")
    given = relationships("/3D/a.model").replace(
        "</Relationships>", f"{mine}<Relationship {picture}<Relationship {web}"
    )
    assert read(archive({"_rels/.rels": given, "3D/a.model": model()})).volume == pytest.approx(6.0)


def test_one_part_named_twice_is_one_model(read):
    given = {"_rels/.rels": relationships("/3D/a.model", "3D/A.model"), "3D/a.model": model()}
    assert read(archive(given)).volume == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("rels", "says"),
    [
        (relationships("/3D/a.model", "/3D/b.model"), "has 2 3D models (/3D/a.model, /3D/b.model)"),
        (relationships(), "has no 3D model by /_rels/.rels"),
        (relationships("/3D/c.model"), "no parts named '/3D/c.model'"),
        (relationships("http://a.org/a.model", more='TargetMode="External"'), "outside of it, 'http://a.org/a.model'"),
        (relationships("/3D/a.model")[:-5], "not readable as 3MF"),
        ("", "not readable as 3MF"),
    ],
)
def test_a_package_that_names_no_one_model_is_refused(rels, says, refused):
    assert says in refused(archive({"_rels/.rels": rels, "3D/a.model": model(), "3D/b.model": OTHER}))


def test_without_relationships_the_only_model_is_read_with_a_notice(read, refused):
    surface = read(archive({"3D/a.model": model()}))
    assert surface.volume == pytest.approx(6.0)
    assert surface.notices == ("the 3MF has no /_rels/.rels: read its only model, '3D/a.model'",)
    both = {"3D/3dmodel.model": model(), "3D/b.model": OTHER}
    assert "no /_rels/.rels and 2 parts that might be one" in refused(archive(both))
    assert "no /_rels/.rels and no .model" in refused(archive({"a.xml": model()}))


def test_a_part_that_is_there_twice_is_refused(refused):
    assert "has 2 parts named '/3D/a.model'" in refused(package(start="/3D/a.model", parts={"3d/A.model": OTHER}))


@pytest.mark.parametrize("how", [{"compression": zipfile.ZIP_STORED}, {}, {"zip64": True}])
def test_archives_stored_deflated_and_of_64_bits(how, read, refused):
    content = package(**how)
    assert read(content).volume == pytest.approx(6.0)
    for size in (0, 10, len(content) // 2, len(content) - 1):
        assert refused(content[:size])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_encodings_of_the_model(encoding, read):
    text = model(thing(more='name="K\xf6rper"'))
    named = text.replace("?>", f' encoding="{encoding.removesuffix("-sig")}"?>', 1).encode(encoding)
    assert list(read(package(named)).groups) == ["K\xf6rper"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_document_types_are_refused_in_every_encoding(encoding, refused):
    bomb = model().replace("?>", '?><!DOCTYPE a [<!ENTITY b "cccc"><!ENTITY d "&b;&b;">]>', 1)
    assert "declares a document type" in refused(package(bomb.encode(encoding)))
    rels = relationships("/a.model").replace("?>", "?><!DOCTYPE a>", 1)
    assert "declares a document type" in refused(archive({"_rels/.rels": rels, "a.model": model()}))


def production(*objects, items, part, **more):
    """A package whose model has objects and items, and an object in /3D/Objects/part.model."""
    root = model(*objects, items=items, more='requiredextensions="p"')
    return package(root, {"3D/Objects/part.model": part, **more}, start="/3D/main.model")


def test_items_and_components_in_other_parts(read):
    """The root is elsewhere, an older 3D/3dmodel.model lies beside; items of the other part are not built."""
    part = model(thing(), group(2, f'objectid="1" transform="{SHIFT}"'), items=('objectid="1"',))
    double = 'transform="2 0 0 0 2 0 0 0 2 0 0 0"'
    beside = {"3D/3dmodel.model": OTHER}
    path = 'p:path="/3D/Objects/part.model"'
    given = production(group(7, f'{path} objectid="1" {double}'), items=('objectid="7"',), part=part, **beside)
    assert read(given).volume == pytest.approx(48.0)
    nested = production(group(7, f'{path} objectid="2" {double}'), items=('objectid="7"',), part=part, **beside)
    assert np.allclose(read(nested).bbox, [[20, 40, 60], [22, 44, 66]])  # moved in the part, then doubled
    item = production(items=(f'{path} objectid="2" {double}',), part=part, **beside)
    assert np.allclose(read(item).bbox, [[20, 40, 60], [22, 44, 66]])
    other_case = production(items=(f'{path.replace("/O", "/o")} objectid="1"',), part=part)
    assert read(other_case).volume == pytest.approx(6.0)


def test_other_parts_that_are_wrong_are_refused(refused):
    path = 'p:path="/3D/Objects/part.model"'
    assert "no parts named '/3D/no.model'" in refused(package(model(items=('p:path="/3D/no.model" objectid="1"',))))
    lost = production(items=(f'{path} objectid="5"',), part=model())
    assert "builds object 5 of '3D/Objects/part.model'" in refused(lost)
    deeper = production(items=(f'{path} objectid="2"',), part=model(group(2, 'p:path="/3D/main.model" objectid="1"')))
    assert "'3D/Objects/part.model' refers to another part" in refused(deeper)
    itself = model(group(1, 'p:path="/3D/3dmodel.model" objectid="1"'))
    assert "more than 20 deep, or a part of themselves" in refused(package(itself))
    assert "a path that is not of the production" in refused(package(model(items=('path="/a" objectid="1"',))))
    encrypted = production(items=(f'{path} objectid="1"',), part=b"%3McF\0\0\0\x0c\0\0\0secret")
    assert "'3D/Objects/part.model' of the 3MF is encrypted" in refused(encrypted)


def test_parts_have_one_unit(read, refused):
    """A part without a unit is in millimetres. lib3mf passes its unit over, so that readers would differ."""
    items = ('p:path="/3D/o.model" objectid="1"',)
    inches = model(more='unit="inch"')
    assert read(package(model(items=items, more='unit="inch"'), {"3D/o.model": inches})).unit == "in"
    for part, unit in ((model(), "millimeter"), (model(more='unit="foot"'), "foot")):
        said = refused(package(model(items=items, more='unit="inch"'), {"3D/o.model": part}))
        assert f"'3D/o.model' is in {unit}, its model in inch: export the 3MF in one unit" in said
    assert read(package(model(more='unit=" meter "'), {"3D/o.model": inches})).unit == "m"  # not built


KNOWN = ("p", "pa", "s", "m", "t")


def test_extensions_that_leave_the_mesh_as_it_is_may_be_required(read):
    surface = read(package(model(more=f'requiredextensions="{" ".join(KNOWN)}"')))
    assert surface.volume == pytest.approx(6.0) and surface.notices == ()


@pytest.mark.parametrize(
    ("prefix", "says"),
    [
        ("x", "'http://example.org/x'"),
        ("b", f"beam lattices ({MICROSOFT}/beamlattice/2017/02)"),
        ("bo", f"boolean operations ({CONSORTIUM}/booleanoperations/2023/07)"),
        ("d", f"displacement maps ({CONSORTIUM}/displacement/2023/10)"),
        ("v", f"volumetric data ({CONSORTIUM}/volumetric/2022/01)"),
        ("sc", f"encrypted parts ({MICROSOFT}/securecontent/2019/04)"),
    ],
)
def test_other_required_extensions_are_refused_by_their_names(prefix, says, read, refused):
    required = model(more=f'requiredextensions="p {prefix}"')
    assert f"requires an extension that is not read, {says}: export" in refused(package(required))
    other = production(items=('p:path="/3D/Objects/part.model" objectid="1"',), part=required)
    assert f"requires an extension that is not read, {says}: export" in refused(other)
    recommended = read(package(model(more=f'recommendedextensions="p {prefix}"')))
    assert recommended.notices == (f"the 3MF recommends an extension that is not read, {says}",)


def test_prefixes_are_those_of_the_root_element(read, refused):
    """The same letter may stand for any namespace; one declared further inside does not count."""
    assert "requires the extension 'q', which it does not declare" in refused(
        package(model(thing(more='xmlns:q="urn:q"'), more='requiredextensions="q"'))
    )
    material = f'requiredextensions="b" xmlns:b="{MICROSOFT}/material/2015/02"'
    text = model(more=material).replace(f' xmlns:b="{MICROSOFT}/beamlattice/2017/02"', "")
    assert read(package(text)).volume == pytest.approx(6.0)


SHAPES = {
    "beam lattices": thing(2, mesh(inside='<b:beamlattice radius="1"><b:beams/></b:beamlattice>')),
    "boolean operations": thing(2, '<bo:booleanshape objectid="1"><bo:boolean objectid="1"/></bo:booleanshape>'),
    "displacement maps": thing(2, "<d:displacementmesh><d:vertices/></d:displacementmesh>"),
    "volumetric data": thing(2, '<v:levelset functionid="3" channel="s" meshid="1"/>'),
    "an image of the body ('lowres')": thing(2, more='s:meshresolution="lowres" s:slicestackid="4"'),
    "an image of the body ('obfuscated')": thing(2, more='pa:modelresolution="obfuscated"'),
    "displacement maps (": thing(2, mesh().replace('v1="0"', 'd:did="3" v1="0"', 1)),
    "has no mesh, it holds {http://example.org/x}nurbs": thing(2, "<x:nurbs/>"),
    "has no mesh, it holds nothing": thing(2, "<metadatagroup/>"),
}


@pytest.mark.parametrize("says", SHAPES)
def test_objects_whose_mesh_is_not_their_shape_are_refused_where_they_are_built(says, read, refused):
    """Required or not. Where another object is built, they do not matter."""
    made = SHAPES[says]
    assert says in refused(package(model(thing(), made, items=('objectid="2"',))))
    inside = group(5, 'objectid="1"', 'objectid="2"')
    assert says in refused(package(model(thing(), made, inside, items=('objectid="5"',))))
    assert read(package(model(thing(), made))).volume == pytest.approx(6.0)


def test_slices_and_fields_beside_a_full_mesh_leave_it_as_it_is(read):
    corner = '<s:vertices><s:vertex x="0" y="0"/></s:vertices>'
    slices = f'<s:slicestack id="4"><s:slice ztop="1">{corner}</s:slice></s:slicestack>'
    full = thing(more='s:meshresolution="fullres" s:slicestackid="4" pa:modelresolution="fullres" p:UUID="a"')
    assert read(package(model(slices, full))).notices == ()
    colours = '<m:colorgroup id="8"><m:color color="#FFF"/></m:colorgroup>'
    colours += '<basematerials id="9"><base name="a"/></basematerials>'
    painted = thing(more='pid="8" pindex="0"').replace('v1="0"', 'pid="9" p1="0" x:paint="4" v1="0"')
    surface = read(
        package(model(colours, painted, build='<metadatagroup><metadata name="a">b</metadata></metadatagroup>'))
    )
    assert surface.volume == pytest.approx(6.0) and surface.notices == ()


def test_unknown_elements_are_left_out_with_all_that_is_in_them(read):
    """Vertices and triangles in an unknown element are not those of the mesh."""
    noise = '<vertex x="9" y="9" z="9"/><triangle v1="0" v2="1" v3="8"/><x:more><item objectid="1"/></x:more>'
    noise = f"<x:more>{noise}</x:more>"
    surface = read(package(model(thing(content=mesh(inside=noise)), build="<x:extra/>")))
    assert surface.volume == pytest.approx(6.0) and len(surface.faces) == 12
    assert surface.notices == (
        "left out 2 kinds of elements that are not read: {http://example.org/x}extra, {http://example.org/x}more",
    )
    fields = read(package(model(thing(content=mesh(inside="<v:volumedata/>")))))
    assert "2022/01}volumedata" in fields.notices[0]


def test_vertices_of_another_namespace_are_no_vertices(refused):
    text = model().replace(f'xmlns="{MICROSOFT}/core/2015/02"', "")
    assert "the root element of the 3MF is 'model', not a model of" in refused(package(text))


@pytest.mark.parametrize("kind", ["support", "solidsupport", "surface"])
def test_objects_that_are_no_body_are_left_out_with_a_notice(kind, read, refused):
    scaffold = thing(2, mesh((9, 9, 9), '<b:beamlattice radius="1"/>'), f'type="{kind}"')
    notice = f"left out 1 objects of type {kind}"
    for given in (
        model(thing(), scaffold, items=('objectid="1"', 'objectid="2"')),
        model(thing(), scaffold, group(3, 'objectid="1"', 'objectid="2"'), items=('objectid="3"',)),
    ):
        surface = read(package(given))
        assert surface.volume == pytest.approx(6.0) and surface.notices == (notice,)
    alone = refused(package(model(scaffold, items=('objectid="2"',))))
    assert f"builds no triangles ({notice})" in alone


@pytest.mark.parametrize("kind", ["other", "x"])
def test_objects_of_other_types_are_refused_where_they_are_built(kind, read, refused):
    strange = thing(2, more=f'type="{kind}"')
    for items, more in (('objectid="2"', ()), ('objectid="3"', (group(3, 'objectid="2"'),))):
        said = refused(package(model(thing(), strange, *more, items=(items,))))
        assert f"builds object 2 of type '{kind}', which is no part of a body" in said
    assert read(package(model(thing(), strange))).volume == pytest.approx(6.0)


def test_the_type_of_an_object_of_components_is_that_of_its_components(read):
    for kind in ("support", "other", "model"):
        outer = group(2, 'objectid="1"').replace("<object ", f'<object type="{kind}" ')
        assert read(package(model(thing(), outer, items=('objectid="2"',)))).volume == pytest.approx(6.0)


def test_components_in_components_have_their_places(read):
    """(1, 2, 3) turned by half a turn, moved, then doubled, in inches. The name of the outermost is a group."""
    first, second = group(2, f'objectid="1" transform="{HALF_TURN}"'), group(3, f'objectid="2" transform="{SHIFT}"')
    third = second.replace('id="3"', 'id="3" name="all"', 1)
    items = ('objectid="3" transform="2 0 0 0 2 0 0 0 2 0 0 0" partnumber="7"',)
    surface = read(package(model(thing(), first, third, items=items, more='unit="inch"')))
    assert surface.volume == pytest.approx(48.0) and surface.unit == "in"
    assert np.allclose(surface.bbox, [[18, 36, 60], [20, 40, 66]])
    assert list(surface.groups) == ["object 1", "all"]


def test_rows_of_a_transform_are_images_of_the_axes(read):
    """x goes to y, y to -x."""
    turned = read(package(model(items=('objectid="1" transform=" 0 1 0  -1 0 0 0 0 1 0 0 10 "',))))
    assert np.allclose(turned.bbox, [[-2, 0, 10], [0, 1, 13]])


@pytest.mark.parametrize("twice", [False, True])
def test_mirrored_bodies_keep_their_orientation(twice, read):
    """Mirrored in an item, or also in a component: no faces are to be turned, so that there is no notice."""
    mirror = 'transform="-1 0 0 0 1 0 0 0 1 0 0 0"'
    inner = group(2, f'objectid="1" {mirror if twice else ""}')
    surface = read(package(model(thing(), inner, items=(f'objectid="2" {mirror}',))))
    assert surface.volume == pytest.approx(6.0) and surface.notices == ()
    assert np.allclose(surface.bbox, [[0, 0, 0], [1, 2, 3]] if twice else [[-1, 0, 0], [0, 2, 3]])


def test_several_items_of_one_object_are_several_bodies(tmp_path):
    path = tmp_path / "two.3mf"
    path.write_bytes(package(model(items=('objectid="1"', f'objectid="1" transform="{SHIFT}"'))))
    assert len(load_surface(path).solids) == 2
    assert np.allclose(load_surface(path, component=1).bbox, [[10, 20, 30], [11, 22, 33]])
    path.write_bytes(package(model(items=('objectid="1"', 'objectid="1"'))))
    at_once = load_surface(path)
    assert at_once.volume == pytest.approx(6.0) and "dropped 1 component" in at_once.notices[0]
    assert at_once.summary()["unit"] == "mm"


@pytest.mark.parametrize(
    ("objects", "says"),
    [
        ((group(2, 'objectid="1"'), thing(1)), "object 2 of the 3MF is made of object 1, which is not there before it"),
        ((group(2, 'objectid="2"'),), "object 2 of the 3MF is made of object 2, which is not there before it"),
        ((thing(2), thing(2)), "object 2 of the 3MF is there twice"),
        ((thing(2, thing(3)),), "object 3 of the 3MF is there twice, or inside of another one"),
        ((thing(2, mesh() + mesh()),), "object 2 of the 3MF has more than one mesh"),
        ((thing(2, "<mesh/><components/>"),), "object 2 of the 3MF has more than one mesh or list of components"),
        ((mesh(), thing(2)), "a mesh or components outside of an object"),
        ((thing("a"),), "an object of the 3MF needs a whole number as id, got 'a'"),
        (
            (thing(2, mesh().replace('x="1"', 'x="1,5"', 1)),),
            "vertex 1 of a 3MF's mesh needs three numbers, got '1,5 0 0'",
        ),
        ((thing(2, mesh().replace('y="0"', "", 1)),), "vertex 0 of a 3MF's mesh needs three numbers"),
        ((thing(2, mesh().replace('v1="0"', 'v1="-1"', 1)),), "a triangle of the 3MF needs a whole number as v1"),
        ((thing(2, mesh().replace('v1="0"', 'v1="8"', 1)),), "vertex number 8 where there are 8 vertices"),
        (
            (thing(1), group(2, 'objectid="1" transform="1 0 0"')),
            "the transform of a component of the 3MF has 3 numbers",
        ),
        (
            (thing(1), group(2, 'objectid="1" transform="a"')),
            "transform of a component of the 3MF has a word that is no",
        ),
    ],
)
def test_damaged_objects_are_refused(objects, says, refused):
    assert says in refused(package(model(*objects, items=('objectid="2"',))))


def test_damaged_items_are_refused(refused):
    assert "an item of the 3MF needs a whole number as objectid, got ''" in refused(package(model(items=("",))))
    assert "builds no triangles: export" in refused(package(model(items=())))
    assert "the unit 'mile' is none of micron, millimeter" in refused(package(model(more='unit="mile"')))


def test_many_copies_of_unused_vertices_stop_at_a_limit(read):
    """1000 vertices that no face uses, in 3000 places: three million, where 64 MB hold 2.8 million."""
    unused = "<vertices>" + '<vertex x="0" y="0" z="0"/>' * 1000 + "</vertices><triangles/>"
    many = group(2, *['objectid="1"'] * 3000)
    with pytest.raises(MeshError, match="builds more than 2796452 vertices"):
        read(package(model(thing(content=f"<mesh>{unused}</mesh>"), many, items=('objectid="2"',))), max_faces=12)


def test_items_that_a_slicer_does_not_print_are_left_out(read, refused):
    away = f'objectid="1" transform="{SHIFT}"'
    surface = read(package(model(items=('objectid="1" printable="1"', f'{away} printable="0"'))))
    assert np.allclose(surface.bbox, [[0, 0, 0], [1, 2, 3]])
    notice = "left out 1 items that a slicer marked as not printable"
    assert surface.notices == (notice,)
    assert f"builds no triangles ({notice})" in refused(package(model(items=('objectid="1" printable="0"',))))


NOTES = {
    "Metadata/Slic3r_PE_model.config": '<volume><metadata type="volume" key="volume_type" value="{}"/></volume>',
    "Metadata/model_settings.config": '<part id="1" subtype="{}"><metadata key="name" value="a"/></part>',
}


@pytest.mark.parametrize("part", NOTES)
def test_parts_that_slicers_note_as_no_material_are_refused(part, read, refused):
    def noted(kind):
        return package(parts={part: f'<config><object id="1">{NOTES[part].format(kind)}</object></config>'})

    for kind in ("ModelPart", "normal_part"):
        assert read(noted(kind)).volume == pytest.approx(6.0)
    for kind in ("NegativeVolume", "ParameterModifier", "negative_part", "support_blocker"):
        assert f"a slicer marks a part of the 3MF as '{kind}', which is no material" in refused(noted(kind))


def test_sets_of_triangles_are_groups(read, refused):
    def sets(rows):
        return package(model(thing(content=mesh(inside=f"<t:trianglesets>{rows}</t:trianglesets>"), more='name="box"')))

    two = (
        '<t:triangleset name="lid" identifier="a"><t:ref index="2"/><t:refrange startindex="4" endindex="6"/>'
        '</t:triangleset><t:triangleset name="end" identifier="b"><t:ref index="0"/></t:triangleset>'
    )
    surface = read(sets(two))
    assert surface.notices == ()
    assert {name: numbers.tolist() for name, numbers in surface.groups.items()} == {
        "lid": [2, 4, 5, 6],
        "end": [0],
        "box": list(range(12)),
    }
    lost = '<t:triangleset name="lid"><t:ref index="12"/></t:triangleset>'
    assert "names triangles that object 1 lacks" in refused(sets(lost))


def test_all_at_once(read):
    """The second item alone, mirrored and doubled, of a part that is turned: x from 8 to 10 goes to -16 to -20."""
    surface = read(archive(PIECES))
    assert surface.volume == pytest.approx(48.0) and surface.unit == "in"
    assert np.allclose(surface.bbox, [[-20, 0, 0], [-16, 2, 6]])
    assert sorted(surface.groups) == ["lid", "object 1"]
    assert [line.split(":")[0].split(",")[0] for line in surface.notices] == [
        "the 3MF recommends an extension that is not read",
        "left out 1 objects of type support",
        "left out 1 items that a slicer marked as not printable",
    ]
