"""Decodes Draco streams in a process of its own; not imported, see `draco`.

Draco's decoder allocates what a stream asks for, and a stream of thirty bytes can ask for
gigabytes. Here the kernel holds it to its limits, and a crash ends this process alone.
"""

import os
import struct
import sys
from typing import Any, BinaryIO

import DracoPy
import numpy as np
from numpy.typing import NDArray

REQUEST = struct.Struct("<qQQQ")  # attribute, bytes, memory, seconds
REPLY = struct.Struct("<B3sIII")  # whether it worked, type, components, points, faces
FAILED = REPLY.pack(0, b"", 0, 0, 0)


def serve(requests: BinaryIO, replies: BinaryIO) -> None:
    """Answer requests until there are no more.

    Parameters
    ----------
    requests : binary file
        Each ``REQUEST`` and the stream.
    replies : binary file
        Each ``REPLY``, positions and faces.
    """
    while header := requests.read(REQUEST.size):
        attribute, size, memory, seconds = REQUEST.unpack(header)
        stream = requests.read(size)
        _limit(memory, seconds)
        try:
            points, faces = _decode(stream, attribute)
        except Exception:  # whatever the decoder raises, the stream is damaged
            replies.write(FAILED)
        else:
            kind = points.dtype.str.encode()
            replies.write(REPLY.pack(1, kind, points.shape[1], len(points), len(faces)))
            replies.write(points.tobytes())
            replies.write(faces.tobytes())
        replies.flush()


def _decode(stream: bytes, attribute: int) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Positions (n, 3) of an attribute and faces (m, 3) of a mesh."""
    mesh = DracoPy.decode(stream)
    found = mesh.get_attribute_by_unique_id(attribute) if attribute >= 0 else None
    points = mesh.points if found is None else found["data"]
    faces = np.ascontiguousarray(mesh.faces, dtype="<u4").reshape(-1, 3)
    return np.ascontiguousarray(points).reshape(len(points), -1), faces


def _limit(memory: int, seconds: int) -> None:
    """Let the process take so much more memory and time than it has taken."""
    if sys.platform != "linux":
        return
    import resource  # there is none on Windows

    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    used = int(usage.ru_utime + usage.ru_stime) + 1
    for kind, value in (
        (resource.RLIMIT_AS, taken + memory),
        (resource.RLIMIT_CPU, used + seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(kind, (value, resource.getrlimit(kind)[1]))


def main() -> None:
    """Serve standard input; what Draco prints goes nowhere."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    serve(sys.stdin.buffer, replies)


if __name__ == "__main__":
    main()
