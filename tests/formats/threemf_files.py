"""Kinds of 3MF files."""

import io
import zipfile
from collections.abc import Mapping

from tests.formats.kinds import BODY, Facts, kind, refused
from tests.meshes import box
from workers.geometry.mesh import TriangleMesh

SPACES = (
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:p="p" xmlns:s="s" '
    'xmlns:b="b" xmlns:m="m" xmlns:d="d" xmlns:v="v" xmlns:bo="bo" xmlns:cura="cura"'
)
ROOT = "3D/3dmodel.model"
ITEM = '<item objectid="1"/>'
ASIDE = box()
TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def rels(target: str = f"/{ROOT}") -> str:
    """Relationships of a package whose root is this part."""
    return (
        '<Relationships xmlns="r"><Relationship Id="t" Type="http://x/metadata/thumbnail" '
        f'Target="/a.png"/><Relationship Id="r" Type="{TYPE}" Target="{target}"/></Relationships>'
    )


def package(
    model: str | bytes, extra: Mapping[str, str | bytes] | None = None, **options: str
) -> bytes:
    """Zip archive of a root part and others."""
    root = options.get("root", ROOT)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("_rels/.rels", options.get("rels", rels("/" + root)))
        archive.writestr(root, model)
        for name, content in (extra or {}).items():
            archive.writestr(name, content)
    return file.getvalue()


def model(resources: str, build: str = ITEM) -> str:
    """XML of a model part."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" {SPACES}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def mesh(*meshes: TriangleMesh, more: str = "") -> str:
    """One mesh element of several meshes."""
    vertices, faces, before = [], [], 0
    for one in meshes:
        vertices += [f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in one.vertices.tolist()]
        faces += [
            f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in (one.faces + before).tolist()
        ]
        before += one.n_vertices
    triangles = f"<triangles>{''.join(faces)}</triangles>" if faces else ""
    return f"<mesh><vertices>{''.join(vertices)}</vertices>{triangles}{more}</mesh>"


def body(id: str = "1", attributes: str = "", inside: str = "") -> str:
    """Object of the body."""
    return f'<object id="{id}" {attributes}>{inside}{mesh(BODY)}</object>'


def aside(id: str, attributes: str = "", inside: str = "") -> str:
    """Object of a box that is no body."""
    return f'<object id="{id}" {attributes}>{inside}{mesh(ASIDE)}</object>'


BOTH = '<item objectid="1"/><item objectid="2"/>'
STACK = (
    '<s:slicestack id="5" zbottom="0"><s:slice ztop="1"><s:vertices><s:vertex x="0" y="0"/>'
    '<s:vertex x="1" y="0"/><s:vertex x="1" y="1"/></s:vertices><s:polygon startv="0">'
    '<s:segment v2="1"/><s:segment v2="2"/><s:segment v2="0"/></s:polygon></s:slice>'
    "</s:slicestack>"
)
LATTICE = (
    '<b:beamlattice radius="1" minlength="0.1" {}><b:beams><b:beam v1="0" v2="1"/>'
    '<b:beam v1="1" v2="2"/></b:beams></b:beamlattice>'
)


@kind("3MF", "one object that is built", "Read.")
def plain() -> bytes:
    return package(model(body()))


@kind("3MF", "slices beside the mesh", "The mesh is read, the slices are named.", found=("slices",))
def slices() -> bytes:
    return package(model(STACK + body("1", 's:slicestackid="5"')))


@kind("3MF", "slices in another part", "The mesh is read.", found=("slices",))
def slice_references() -> bytes:
    stack = (
        '<s:slicestack id="5"><s:sliceref slicestackid="5" slicepath="/2D/a.model"/></s:slicestack>'
    )
    root = model(stack + body("1", 's:slicestackid="5" s:meshresolution="lowres"'))
    return package(root, {"2D/a.model": model(STACK, "")})


@refused(
    *("3MF", "slices only", "There is no mesh: export it with its mesh, or as STL."),
    reason="slices only, no mesh",
)
def slices_only() -> bytes:
    return package(model(STACK + f'<object id="1" s:slicestackid="5">{mesh()}</object>'))


@refused(
    *("3MF", "a beam lattice only", "Turn it into a mesh in the program that made it."),
    reason="a beam lattice only, no mesh",
)
def lattice_only() -> bytes:
    points = TriangleMesh(ASIDE.vertices, ASIDE.faces[:0])
    return package(model(f'<object id="1">{mesh(points, more=LATTICE.format(""))}</object>'))


@kind("3MF", "a beam lattice with a mesh", "The mesh is read.", found=("1 beam lattice",))
def lattice_and_mesh() -> bytes:
    return package(model(f'<object id="1">{mesh(BODY, more=LATTICE.format(""))}</object>'))


@kind(
    *("3MF", "a beam lattice that is shown by a mesh", "That mesh is read."),
    found=("1 beam lattice",),
)
def lattice_shown() -> bytes:
    points = TriangleMesh(ASIDE.vertices, ASIDE.faces[:0])
    lattice = LATTICE.format('representationmesh="7"')
    shown = f'<object id="1">{mesh(points, more=lattice)}</object>'
    return package(model(body("7", 'type="other"') + shown))


@refused(
    *("3MF", "an implicit surface only", "Turn it into a mesh in the program that made it."),
    reason="an implicit surface only, no mesh",
)
def implicit() -> bytes:
    level = '<v:levelset functionid="3" channel="shape" meshid="2"/>'
    return package(model(f'{aside("2")}<object id="1">{level}</object>'))


@refused(
    *("3MF", "a boolean operation only", "Turn it into a mesh in the program that made it."),
    reason="a boolean operation only",
)
def boolean() -> bytes:
    shape = '<bo:booleanshape objectid="2" operation="difference"><bo:boolean objectid="3"/>'
    objects = f'{body("2")}{aside("3")}<object id="1">{shape}</bo:booleanshape></object>'
    return package(model(objects))


@kind("3MF", "a displaced mesh", "Read without the displacement.", found=("displacement map",))
def displaced() -> bytes:
    text = (
        mesh(BODY)
        .replace("<", "<d:")
        .replace("<d:/", "</d:")
        .replace("d:mesh", "d:displacementmesh")
    )
    maps = '<d:displacement2d id="4" path="/a.png" channel="G"/>'
    return package(model(f'{maps}<object id="1">{text}</object>'))


@kind(
    *("3MF", "colours, materials and textures", "Left alone and named."),
    found=("materials", "colours", "2 textures"),
)
def materials() -> bytes:
    return package(
        model(
            '<basematerials id="8"><base name="a" displaycolor="#FF0000"/></basematerials>'
            '<m:colorgroup id="9"><m:color color="#00FF00"/></m:colorgroup>'
            '<m:texture2d id="10" path="/a.png"/><m:texture2d id="11" path="/b.png"/>'
            + body("1", 'pid="9" pindex="0"')
        )
    )


for name, kind_of_object in (
    *(("support", "1 support object, left out"), ("solidsupport", "1 support object, left out")),
    *(("other", "of type 'other', left out"), ("surface", "of type 'surface', left out")),
):

    @kind(
        *("3MF", f"an object of type {name} beside the body", "Left out and named."),
        found=(kind_of_object,),
    )
    def of_type(name: str = name) -> bytes:
        return package(model(body() + aside("2", f'type="{name}"'), BOTH))


@kind(
    *("3MF", "nothing but a support object", "Read as the body, since nothing else is there."),
    repairs=("the file has no body",),
)
def support_only() -> bytes:
    return package(model(body("1", 'type="support"')))


@kind(
    *("3MF", "an item that is not to be printed", "Left out, unless all are so."),
    found=("1 object that is not to be printed",),
)
def not_printed() -> bytes:
    items = ITEM + '<item objectid="2" printable="0"/>'
    return package(model(body() + aside("2"), items))


@kind("3MF", "nothing is to be printed", "All is read.", repairs=("has no body",))
def none_printed() -> bytes:
    return package(model(body(), '<item objectid="1" printable="0"/>'))


def slic3r(metadata: str, name: str = "Metadata/Slic3r_PE_model.config") -> bytes:
    """PrusaSlicer project whose object ends with a box."""
    last, first = BODY.n_faces + ASIDE.n_faces - 1, BODY.n_faces
    config = (
        f'<config><object id="1"><volume firstid="0" lastid="{first - 1}"><metadata type="volume" '
        f'key="volume_type" value="ModelPart"/></volume><volume firstid="{first}" lastid="{last}">'
        f'<metadata type="volume" {metadata}/></volume></object></config>'
    )
    return package(model(f'<object id="1">{mesh(BODY, ASIDE)}</object>'), {name: config})


for volume_type, told in (
    *(("ParameterModifier", "1 modifier"), ("NegativeVolume", "1 negative volume")),
    *(("SupportEnforcer", "1 support enforcer"), ("SupportBlocker", "1 support blocker")),
):

    @kind(
        *("3MF", f"PrusaSlicer's volume of type {volume_type}", "Left out and named."),
        found=(f"{told}, left out",),
    )
    def prusa(volume_type: str = volume_type) -> bytes:
        return slic3r(f'key="volume_type" value="{volume_type}"')


@kind("3MF", "Slic3r's old sign of a modifier", "Left out and named.", found=("1 modifier",))
def old_modifier() -> bytes:
    return slic3r('key="modifier" value="1"', "Metadata\\SuperSlicer_model.config")


def bambu(subtype: str) -> bytes:
    """BambuStudio project: an object of two components in a part of their own."""
    components = "".join(
        f'<component p:path="/3D/Objects/object_1.model" objectid="{i}"/>' for i in (1, 2)
    )
    root = model(
        f'<object id="3"><components>{components}</components></object>', '<item objectid="3"/>'
    )
    config = (
        '<config><object id="3"><metadata key="name" value="a"/><part id="1" subtype="normal_part">'
        f'<metadata key="name" value="b"/></part><part id="2" subtype="{subtype}"/></object>'
        '<plate><metadata key="plater_id" value="1"/></plate></config>'
    )
    objects = model(body() + aside("2"), "")
    more = {"3D/Objects/object_1.model": objects, "Metadata/model_settings.config": config}
    return package(root, more)


for subtype, told in (
    *(("modifier_part", "1 modifier"), ("negative_part", "1 negative volume")),
    *(("support_enforcer", "1 support enforcer"), ("support_blocker", "1 support blocker")),
):

    @kind(
        *("3MF", f"BambuStudio's or OrcaSlicer's {subtype}", "Left out and named."),
        found=(f"{told}, left out",),
    )
    def orca(subtype: str = subtype) -> bytes:
        return bambu(subtype)


@kind("3MF", "Cura's infill mesh", "Left out and named.", found=("of type 'modifier', left out",))
def cura() -> bytes:
    setting = '<metadatagroup><metadata name="cura:infill_mesh">True</metadata></metadatagroup>'
    return package(model(body() + aside("2", "", setting), BOTH))


TWICE = Facts(area=2 * BODY.area, components=2, vertices=2 * BODY.n_vertices)


@kind("3MF", "several plates or copies", "All are read, where they lie.", facts=TWICE)
def plates() -> bytes:
    items = ITEM + '<item objectid="1" transform="1 0 0 0 1 0 0 0 1 500 0 0"/>'
    return package(model(body(), items))


@kind("3MF", "components of components in other parts", "Placed by all their transforms.")
def components() -> bytes:
    middle = (
        '<object id="1"><components><component p:path="/3D/Objects/b%20c.model" objectid="4" '
        'transform="0 1 0 -1 0 0 0 0 1 5 0 0"/></components></object>'
    )
    root = model(
        '<object id="1"><components><component p:path="3D/Objects/a.model" objectid="1"/>'
        "</components></object>"
    )
    more = {"3D/Objects/a.model": model(middle, ""), "3D/Objects/B c.model": model(body("4"), ITEM)}
    return package(root, more)


@kind("3MF", "a root part under another name", "Found by the relationships of the package.")
def other_root() -> bytes:
    other = {ROOT: model(aside("1"))}
    return package(model(body()), other, root="Model/thing.model")


@kind("3MF", "a root part of another ending", "Found by the relationships of the package.")
def other_ending() -> bytes:
    return package(model(body()), root="Model/thing.xml")


@kind("3MF", "damaged relationships", "The usual name is taken.")
def damaged_relationships() -> bytes:
    return package(model(body()), rels="<Relationships><broken")


@kind("3MF", "backslashes in the archive's names", "Read as slashes.")
def backslashes() -> bytes:
    return package(model(body()), root="3D\\3dmodel.model", rels=rels())


@kind("3MF", "UTF-16", "Read.")
def utf_16() -> bytes:
    return package(model(body()).replace('encoding="UTF-8"', 'encoding="UTF-16"').encode("utf-16"))


@kind("3MF", "blanks and a byte order mark before the XML", "Read.")
def byte_order_mark() -> bytes:
    return package(b"\xef\xbb\xbf\r\n " + model(body()).encode())


@kind("3MF", "prefixes before all names", "Read.")
def prefixes() -> bytes:
    text = model(body()).replace("<", "<c:").replace("<c:/", "</c:").replace("<c:?", "<?")
    return package(text.replace(' x="', ' c:x="').replace(' v1="', ' c:v1="'))


@kind("3MF", "commas for decimal points", "Read as points.")
def commas() -> bytes:
    text = mesh(BODY).replace(".", ",")
    return package(model(f'<object id="1">{text}</object>'))


@kind("3MF", "nothing is built", "All objects are read.")
def no_build() -> bytes:
    parts = '<object id="2"><components><component objectid="1"/></components></object>'
    return package(model(body() + parts, ""))


@kind(
    "3MF", "an object without an id", "Taken for the one that is built.", repairs=("without an id",)
)
def no_id() -> bytes:
    return package(model(f"<object>{mesh(BODY)}</object>"))


@kind("3MF", "a mirroring transform", "The triangles are turned with it.")
def mirrored() -> bytes:
    return package(model(body(), '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'))


@refused(
    *("3MF", "encrypted (secure content)", "Save it without protection."),
    reason="encrypted (secure content)",
)
def secure() -> bytes:
    root = model(
        '<object id="1"><components><component p:path="/3D/a.model" objectid="1"/></components>'
        "</object>"
    )
    return package(root, {"3D/a.model": bytes(range(256)), "Secure/keystore.xml": "<keystore/>"})
