"""Packages of 3MF made by code, one piece of XML after another."""

import io
import zipfile

from mesh_files import CUBE, TRIANGLES

MICROSOFT = "http://schemas.microsoft.com/3dmanufacturing"
CONSORTIUM = "http://schemas.3mf.io/3dmanufacturing"
SPACES = {  # by the prefixes that the pieces below use
    "p": f"{MICROSOFT}/production/2015/06",
    "pa": f"{MICROSOFT}/production/alternatives/2021/04",
    "s": f"{MICROSOFT}/slice/2015/07",
    "m": f"{MICROSOFT}/material/2015/02",
    "t": f"{MICROSOFT}/trianglesets/2021/07",
    "b": f"{MICROSOFT}/beamlattice/2017/02",
    "bo": f"{CONSORTIUM}/booleanoperations/2023/07",
    "d": f"{CONSORTIUM}/displacement/2023/10",
    "v": f"{CONSORTIUM}/volumetric/2022/01",
    "sc": f"{MICROSOFT}/securecontent/2019/04",
    "x": "http://example.org/x",
}
MODEL = f"{MICROSOFT}/2013/01/3dmodel"
TYPES = (
    '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)


def mesh(size=(1, 2, 3), inside=""):
    """A box with a corner at the origin. inside: XML after its triangles."""
    corners = "".join('<vertex x="{:g}" y="{:g}" z="{:g}"/>'.format(*(CUBE * size)[k]) for k in range(8))
    rows = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in TRIANGLES)
    return f"<mesh><vertices>{corners}</vertices><triangles>{rows}</triangles>{inside}</mesh>"


def thing(number=1, content=None, more=""):
    """An object, a box of volume 6 where no content is given. more: XML of its attributes."""
    return f'<object id="{number}" {more}>{mesh() if content is None else content}</object>'


def group(number, *components):
    """An object of components, each the XML of the attributes of one."""
    return thing(number, f"<components>{''.join(f'<component {words}/>' for words in components)}</components>")


def model(*objects, items=('objectid="1"',), more="", build=""):
    """A model of objects; items: the XML of the attributes of each. more: of the root's. build: XML after the items."""
    spaces = "".join(f' xmlns:{prefix}="{space}"' for prefix, space in SPACES.items())
    built = "".join(f"<item {words}/>" for words in items)
    return (
        f'<?xml version="1.0"?><model xmlns="{MICROSOFT}/core/2015/02"{spaces} {more}>'
        f"<resources>{''.join(objects or [thing()])}</resources><build>{built}{build}</build></model>"
    )


def relationships(*targets, more=""):
    """The relationships of a package to models. more: XML of the attributes of each."""
    rows = "".join(f'<Relationship Id="r{k}" Type="{MODEL}" Target="{t}" {more}/>' for k, t in enumerate(targets))
    space = "http://schemas.openxmlformats.org/package/2006/relationships"
    return f'<?xml version="1.0"?><Relationships xmlns="{space}">{rows}</Relationships>'


def package(content=None, parts=(), start="/3D/3dmodel.model", **how):
    """A package. content: of the model. parts: others, by their names. how: of the archive, as `zipfile.ZipFile`."""
    named = {"_rels/.rels": relationships(start), start.lstrip("/"): model() if content is None else content}
    return archive({**named, **dict(parts)}, **how)


def archive(members, compression=zipfile.ZIP_DEFLATED, zip64=False):
    """An archive of members by their names, and of the types that a package needs."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as packed:
        for name, content in {"[Content_Types].xml": TYPES, **members}.items():
            data = content.encode() if isinstance(content, str) else content
            with packed.open(zipfile.ZipInfo(name), "w", force_zip64=zip64) as member:
                member.write(data)
    return stream.getvalue()


def _sets():
    lid = '<t:triangleset name="lid" identifier="a"><t:ref index="2"/><t:refrange startindex="4" endindex="6"/>'
    return f"<t:trianglesets>{lid}</t:triangleset></t:trianglesets>"


PIECES = {  # a package with all that is read
    "_rels/.rels": relationships("/3D/main.model"),
    "3D/main.model": model(
        thing(1, mesh(inside="<v:volumedata/>"), 's:meshresolution="fullres" pid="4" name="box"'),
        group(2, 'p:path="/3D/Objects/part.model" objectid="2" transform="0 1 0 -1 0 0 0 0 1 10 0 0"'),
        thing(3, more='type="support"'),
        items=('objectid="1" printable="0"', 'objectid="2" transform="-2 0 0 0 2 0 0 0 2 0 0 0"', 'objectid="3"'),
        more='unit="inch" requiredextensions="p m t" recommendedextensions="v"',
    ),
    "3D/Objects/part.model": model(
        thing(1, mesh(inside=_sets())), group(2, 'objectid="1"'), items=(), more='unit="inch"'
    ),
    "Metadata/model_settings.config": '<config><part id="1" subtype="normal_part"/></config>',
}
