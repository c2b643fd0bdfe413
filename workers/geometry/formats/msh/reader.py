"""Gmsh's MSH, versions 1, 2 and 4, in text and binary."""

import re

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.msh import version2, version4
from workers.geometry.formats.msh.elements import node_indices
from workers.geometry.formats.msh.sections import read_sections
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.cells import Cells, join_cells, surface_of_cells
from workers.geometry.formats.text.tokens import Polygons

START = re.compile(rb"\s*\$(?:MeshFormat|NOD|Comments)\b")
TEXT = re.compile(rb"\$MeshFormat\s+\S+\s+0\s|\$NOD\b")


def is_msh(data: bytes) -> bool:
    """Whether the bytes begin as Gmsh's meshes do.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True for text and binary alike.
    """
    return START.match(data[:4096]) is not None


def read_msh(data: bytes, limits: MeshLimits) -> Reading:
    """Read a mesh of Gmsh.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        All nodes, triangles and quads, and the boundary of volume elements.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    if b"\r" in data and TEXT.search(data[:4096]):
        data = data.replace(b"\r", b"\n")
    file = read_sections(data)
    reader = version4 if file.version.startswith("4") else version2
    names = ("nod", "elm") if file.version == "1" else ("nodes", "elements")
    for name in names:
        if name not in file.sections:
            raise InvalidMeshError(f"the MSH file has no section ${name.title()}: it is truncated")
    repairs: list[str] = []
    tags, vertices = reader.read_nodes(file, file.sections[names[0]], limits, repairs)
    elements = join_cells(reader.read_elements(file, file.sections[names[1]], repairs))
    corners = Polygons(elements.corners.counts, node_indices(tags, elements.corners.corners))
    surface = surface_of_cells(vertices, Cells(elements.types, corners), limits)
    return Reading(surface.mesh, tuple(repairs), surface.found)
