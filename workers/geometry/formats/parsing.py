"""Bytes to a mesh: the one entrance for everything that is uploaded."""

import lzma
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from workers.errors import InvalidMeshError, ProteusError
from workers.geometry.formats.amf.package import read_amf
from workers.geometry.formats.brains import (
    read_brainvisa,
    read_freesurfer,
    read_freesurfer_text,
    read_gifti,
    read_mni,
)
from workers.geometry.formats.collada import read_collada
from workers.geometry.formats.containers import unwrap
from workers.geometry.formats.detect import detect_format
from workers.geometry.formats.gltf import read_gltf
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.msh import read_medit, read_msh
from workers.geometry.formats.obj import read_obj
from workers.geometry.formats.off import read_off
from workers.geometry.formats.ply import read_ply
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.stl import read_stl
from workers.geometry.formats.text.encodings import readable
from workers.geometry.formats.threemf import read_3mf
from workers.geometry.formats.vtk import read_legacy_vtk, read_vtk_xml
from workers.geometry.mesh import TriangleMesh

Reader = Callable[[bytes, MeshLimits], Reading]
Axis = Literal["y", "z"]

READERS: Mapping[str, Reader] = MappingProxyType(
    {
        "off": read_off,
        "obj": read_obj,
        "ply": read_ply,
        "stl": read_stl,
        "glb": read_gltf,
        "gltf": read_gltf,
        "3mf": read_3mf,
        "amf": read_amf,
        "dae": read_collada,
        "vtk": read_legacy_vtk,
        "vtp": read_vtk_xml,
        "freesurfer": read_freesurfer,
        "freesurfer-text": read_freesurfer_text,
        "gifti": read_gifti,
        "mni": read_mni,
        "brainvisa": read_brainvisa,
        "msh": read_msh,
        "medit": read_medit,
    }
)
UPRIGHT_Z = ("stl", "3mf", "amf", "freesurfer", "freesurfer-text", "gifti", "mni", "brainvisa")
DEFAULT_LIMITS = MeshLimits()
DAMAGED = (
    *(ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError),
    *(EOFError, MemoryError, struct.error, zipfile.BadZipFile, zlib.error),
    lzma.LZMAError,
)


@dataclass(frozen=True, eq=False)
class ParsedMesh:
    """What a file held.

    Attributes
    ----------
    mesh : TriangleMesh
        As in the file, triangulated, not cleaned; indices lie in range.
    format : str
        One of the names of `detect_format`.
    up : "y" or "z"
        The axis that points up by the format's standard or custom.
    repairs : tuple of str
        Where the file breaks its format's rules and how it was read all the same.
    found : tuple of str
        What else the file holds, and what is left alone.
    """

    mesh: TriangleMesh
    format: str
    up: Axis
    repairs: tuple[str, ...] = ()
    found: tuple[str, ...] = ()


def parse(data: bytes, *, filename: str = "", limits: MeshLimits = DEFAULT_LIMITS) -> ParsedMesh:
    """Read a file in any of the formats, compressed or not.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Its ending decides only where the content does not; that of a compressed file is the one
        before ``.gz``.
    limits : MeshLimits
        Checked against declared counts before anything is allocated.

    Returns
    -------
    ParsedMesh
        The mesh, its format, and the axis that points up.

    Raises
    ------
    InvalidMeshError
        Truncated or damaged, an index out of range, no faces.
    UnsupportedFormatError
        Of no known format, or of a variant that is not read.
    UploadTooLargeError
        Over the limits.
    """
    name = ""
    try:
        data, filename = unwrap(data, filename, limits)
        plain = readable(data)
        name = detect_format(plain.data, filename)
        reading = READERS[name](plain.data, limits)
    except ProteusError:
        raise
    except DAMAGED as error:  # whatever damage a reader stumbled over without naming it
        known = f" as {name.upper()}" if name else ""
        raise InvalidMeshError(f"the file is damaged and cannot be read{known}") from error
    up: Axis = reading.up or ("z" if name in UPRIGHT_Z else "y")
    return ParsedMesh(reading.mesh, name, up, plain.repairs + reading.repairs, reading.found)
