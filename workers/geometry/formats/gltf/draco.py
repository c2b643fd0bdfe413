"""Primitives under KHR_draco_mesh_compression, decoded within limits."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import IntArray
from workers.geometry.formats.gltf.draco_child import REPLY, REQUEST
from workers.geometry.formats.limits import MeshLimits

NAME = "KHR_draco_mesh_compression"
CHILD = Path(__file__).with_name("draco_child.py")
MESH, SEQUENTIAL, METADATA = 1, 0, 0x8000
NEWEST = (2, 2)
FACES_A_BYTE = 64  # a regular grid of a million faces takes a byte for 14
MEMORY, MEMORY_A_FACE = 128 << 20, 300  # bytes; 125 a face were measured, with normals
SECONDS, FACES_A_SECOND = 4, 100_000


@dataclass(frozen=True)
class Counts:
    """How large a mesh says it is.

    Attributes
    ----------
    vertices, faces : int
        From 0.
    """

    vertices: int
    faces: int


def declared_counts(stream: bytes) -> Counts | None:
    """Counts in the header of a Draco stream.

    Parameters
    ----------
    stream : bytes
        The whole stream.

    Returns
    -------
    Counts or None
        None where metadata or an older version keep them elsewhere.

    Raises
    ------
    InvalidMeshError
        No Draco mesh, or more faces than so few bytes can hold.
    UnsupportedFormatError
        Of a version that is not known.
    """
    if not stream.startswith(b"DRACO") or len(stream) < 13:
        raise InvalidMeshError("the Draco data of the glTF file is damaged: it has no header")
    version, kind, method = (stream[5], stream[6]), stream[7], stream[8]
    if kind != MESH:
        raise InvalidMeshError("the Draco data of the glTF file holds points; expected a mesh")
    if version > NEWEST:
        raise UnsupportedFormatError(f"Draco {version[0]}.{version[1]} is not read; expected 2.2")
    if version < NEWEST or int.from_bytes(stream[9:11], "little") & METADATA:
        return None
    first, at = _variable_length(stream, 11 if method == SEQUENTIAL else 12)
    second, _ = _variable_length(stream, at)
    faces, vertices = (first, second) if method == SEQUENTIAL else (second, first)
    if faces > FACES_A_BYTE * len(stream) or vertices > 3 * faces:
        raise InvalidMeshError(
            f"the Draco data of the glTF file declares {vertices:,} vertices and {faces:,} faces "
            f"in {len(stream):,} bytes: it is damaged"
        )
    return Counts(vertices, faces)


class DracoDecoder:
    """Decodes the Draco streams of one file, all in one process that starts with the first.

    Parameters
    ----------
    limits : MeshLimits
        For all streams together.
    """

    def __init__(self, limits: MeshLimits) -> None:
        self._limits = limits
        self._n_vertices = 0
        self._n_faces = 0
        self._process: subprocess.Popen[bytes] | None = None

    def decode(
        self, stream: bytes, attribute: int, counts: Counts
    ) -> tuple[NDArray[Any], IntArray]:
        """Positions and faces of a stream.

        Parameters
        ----------
        stream : bytes
            Of one primitive.
        attribute : int
            Unique number of the positions; below 0 for the only ones.
        counts : Counts
            What the accessors declare, checked against the limits.

        Returns
        -------
        positions : (n, 3) array
            Of the type in the stream.
        faces : (m, 3) int64
            Not checked against n.

        Raises
        ------
        InvalidMeshError
            Damaged, or it takes more memory or time than a mesh of its size may.
        UnsupportedFormatError
            Of a version that is not known.
        UploadTooLargeError
            Over the limits.
        """
        header = declared_counts(stream) or counts
        self._check(header.vertices, header.faces)
        size = max(header.faces, counts.faces, header.vertices, counts.vertices)
        memory, seconds = MEMORY + MEMORY_A_FACE * size, SECONDS + size // FACES_A_SECOND
        requests, replies = self._pipes()
        try:
            requests.write(REQUEST.pack(attribute, len(stream), memory, seconds) + stream)
            requests.flush()
            worked, kind, width, n_points, n_faces = REPLY.unpack(_exactly(replies, REPLY.size))
            if not worked or width != 3:
                raise InvalidMeshError("the Draco data of the glTF file is damaged")
            self._check(n_points, n_faces)
            self._n_vertices += n_points
            self._n_faces += n_faces
            dtype = np.dtype(kind.decode())
            points = np.frombuffer(_exactly(replies, n_points * width * dtype.itemsize), dtype)
            faces = np.frombuffer(_exactly(replies, n_faces * 12), "<u4").astype(np.int64)
        except (BrokenPipeError, EOFError):
            raise InvalidMeshError(
                "the Draco data of the glTF file is damaged: decoding it crashed, or took more "
                "memory or time than a mesh of its size may"
            ) from None
        return points.reshape(-1, 3), faces.reshape(-1, 3)

    def close(self) -> None:
        """End the process, if one was started."""
        if self._process is None:
            return
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                _close(pipe)
        self._process.kill()
        self._process.wait()
        self._process = None

    def _check(self, vertices: int, faces: int) -> None:
        """Raise ``UploadTooLargeError`` if so many more are too many."""
        self._limits.check(vertices=self._n_vertices + vertices, faces=self._n_faces + faces)

    def _pipes(self) -> tuple[IO[bytes], IO[bytes]]:
        """Standard input and output of the process."""
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-P", str(CHILD)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            )
        requests, replies = self._process.stdin, self._process.stdout
        if requests is None or replies is None:
            raise EOFError
        return requests, replies


def _exactly(pipe: IO[bytes], size: int) -> bytes:
    """So many bytes, or ``EOFError``."""
    data = pipe.read(size)
    if len(data) < size:
        raise EOFError
    return data


def _close(pipe: IO[bytes]) -> None:
    """Close a pipe whose other end may be gone."""
    try:
        pipe.close()
    except BrokenPipeError:
        return


def _variable_length(stream: bytes, at: int) -> tuple[int, int]:
    """Integer of seven bits a byte, and where it ends."""
    value = 0
    for place, byte in enumerate(stream[at : at + 5]):
        value |= (byte & 0x7F) << (7 * place)
        if byte < 0x80:
            return value, at + place + 1
    raise InvalidMeshError("the Draco data of the glTF file is damaged: it has no counts")
