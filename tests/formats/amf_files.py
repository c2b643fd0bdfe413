"""Kinds of AMF files."""

import io
import zipfile

import numpy as np

from tests.formats.kinds import BODY, Facts, kind
from tests.meshes import box
from workers.geometry.mesh import TriangleMesh

ASIDE = box()


def vertices_xml(*meshes: TriangleMesh, more: str = "") -> str:
    """Vertices of several meshes."""
    rows = np.concatenate([mesh.vertices for mesh in meshes]).tolist()
    points = "".join(
        f"<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates>{more}</vertex>"
        for x, y, z in rows
    )
    return f"<vertices>{points}</vertices>"


def volume(mesh: TriangleMesh, first: int = 0, attributes: str = "", more: str = "") -> str:
    """Volume of all triangles of a mesh, whose vertices begin at the first."""
    rows = (mesh.faces + first).tolist()
    faces = "".join(
        f"<triangle><v1>{a}</v1><v2>{b}</v2><v3>{c}</v3></triangle>" for a, b, c in rows
    )
    return f"<volume {attributes}>{more}{faces}</volume>"


def thing(id: str = "1", more: str = "") -> str:
    """Object of the body."""
    mesh = f"<mesh>{vertices_xml(BODY, more=more)}{volume(BODY)}</mesh>"
    return f'<object id="{id}">{mesh}</object>'


def amf(content: str) -> bytes:
    """File of this content."""
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<amf unit="inch">{content}</amf>\n'.encode()


def zipped(data: bytes, *others: str) -> bytes:
    """Zip archive of an AMF file and others."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in others:
            archive.writestr(name, "other")
        archive.writestr("thing.amf", data)
    return file.getvalue()


def with_aside(attributes: str = "", more: str = "") -> bytes:
    """Object of the body and a second volume, a box."""
    first = BODY.n_vertices
    second = volume(ASIDE, first, attributes, more)
    return amf(
        f'<object id="0"><mesh>{vertices_xml(BODY, ASIDE)}{volume(BODY)}{second}</mesh></object>'
    )


@kind("AMF", "plain XML", "Read.")
def plain() -> bytes:
    return amf(thing())


@kind("AMF", "zipped", "Unpacked and read.", filename="thing.amf")
def in_a_zip() -> bytes:
    return zipped(amf(thing()))


@kind("AMF", "zipped, with a slicer's settings beside", "Unpacked and read.")
def in_a_zip_with_others() -> bytes:
    return zipped(amf(thing()), "Metadata/thumbnail.png", "__MACOSX/._thing.amf")


@kind("AMF", "several volumes of one mesh", "All are read.")
def volumes() -> bytes:
    half = BODY.n_faces // 2
    parts = [TriangleMesh(BODY.vertices, BODY.faces[part]) for part in (np.s_[:half], np.s_[half:])]
    both = "".join(volume(part, attributes='materialid="2"') for part in parts)
    return amf(f'<object id="0"><mesh>{vertices_xml(BODY)}{both}</mesh></object>')


@kind("AMF", "a volume of type support", "Left out and named.", found=("1 support volume",))
def support() -> bytes:
    return with_aside('type="support"')


@kind("AMF", "PrusaSlicer's modifier", "Left out and named.", found=("1 modifier, left out",))
def modifier() -> bytes:
    return with_aside(more='<metadata type="slic3r.volume_type">ParameterModifier</metadata>')


@kind("AMF", "Slic3r's old sign of a modifier", "Left out and named.", found=("1 modifier",))
def old_modifier() -> bytes:
    return with_aside(more='<metadata type="slic3r.modifier">1</metadata>')


@kind("AMF", "nothing but a support volume", "Read as the body.", repairs=("has no body",))
def support_only() -> bytes:
    only = volume(BODY, attributes='type="support"')
    return amf(f'<object id="0"><mesh>{vertices_xml(BODY)}{only}</mesh></object>')


@kind(
    *("AMF", "curved triangles (normals, edges)", "Read flat, and said."),
    found=("curved triangles, read flat",),
)
def curved() -> bytes:
    return amf(thing(more="<normal><nx>0</nx><ny>0</ny><nz>1</nz></normal>"))


@kind(
    *("AMF", "colours and materials", "Left alone and named."),
    found=("colours", "materials"),
)
def colours() -> bytes:
    colour = "<color><r>1</r><g>0</g><b>0</b></color>"
    return amf(f'<material id="2">{colour}</material>' + thing(more=colour))


TWICE = Facts(area=2 * BODY.area, components=2, vertices=2 * BODY.n_vertices)


@kind("AMF", "a constellation", "Each instance is placed.", facts=TWICE)
def constellation() -> bytes:
    instances = (
        '<instance objectid="1"><deltax>0</deltax><rz>0</rz></instance>'
        '<instance objectid="1"><deltax>500</deltax><rx>90</rx><rz>45</rz></instance>'
    )
    return amf(thing() + f'<constellation id="9">{instances}</constellation>')


@kind("AMF", "an object that its constellation does not print", "Left out.", found=("not to be",))
def not_printed() -> bytes:
    instances = (
        '<instance objectid="1"><printable>1</printable></instance>'
        '<instance objectid="1"><printable>0</printable></instance>'
    )
    return amf(thing() + f'<constellation id="9">{instances}</constellation>')


@kind("AMF", "Latin-1 without saying so", "Read.")
def latin_1() -> bytes:
    text = f'<?xml version="1.0"?><amf><metadata type="name">Würfel</metadata>{thing()}</amf>'
    return text.encode("latin-1")


@kind("AMF", "UTF-16", "Read.")
def utf_16() -> bytes:
    return amf(thing()).decode().replace("UTF-8", "UTF-16").encode("utf-16")


@kind("AMF", "commas for decimal points, blanks around numbers", "Read.")
def commas() -> bytes:
    text = vertices_xml(BODY).replace(".", ",").replace("<x>", "<x> ").replace("</y>", "\n</y>")
    return amf(f'<object id="0"><mesh>{text}{volume(BODY)}</mesh></object>')


@kind("AMF", "without an XML declaration, after a comment", "Read.")
def bare() -> bytes:
    return b"\r\n<!-- v 1 2 3 -->\n" + amf(thing()).partition(b"\n")[2]
