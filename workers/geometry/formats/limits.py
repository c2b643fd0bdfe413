"""How large a mesh may be; checked against declared counts before anything is allocated."""

from dataclasses import dataclass

from workers.errors import InvalidMeshError, UploadTooLargeError


@dataclass(frozen=True)
class MeshLimits:
    """The largest mesh that is accepted.

    Attributes
    ----------
    vertices, faces : int
        Most vertices (not for STL, which stores three a face) and most triangles.
    unpacked : int
        Most bytes that a compressed file may unpack to, all that is in it together.
    """

    vertices: int = 2_000_000
    faces: int = 4_000_000
    unpacked: int = 512 << 20

    def check(self, *, vertices: int = 0, faces: int = 0) -> None:
        """Raise ``UploadTooLargeError`` if one of the counts is over its limit.

        Parameters
        ----------
        vertices, faces : int
            Counts that a file declares, or that were read so far.

        Raises
        ------
        UploadTooLargeError
            A count over its limit.
        InvalidMeshError
            A count below 0.
        """
        for count, limit, noun in (
            (vertices, self.vertices, "vertices"),
            (faces, self.faces, "faces"),
        ):
            if count < 0:
                raise InvalidMeshError(f"the file declares {count} {noun}")
            if count > limit:
                raise UploadTooLargeError(
                    f"the mesh has {count:,} {noun}, but at most {limit:,} are accepted"
                )


def check_length(needed: int, available: int, *, vertices: int, faces: int) -> None:
    """Raise ``InvalidMeshError`` if so many vertices and faces cannot lie in so few bytes.

    Parameters
    ----------
    needed, available : int
        Bytes that the declared counts take at least, and bytes that there are.
    vertices, faces : int
        The declared counts, for the message.

    Raises
    ------
    InvalidMeshError
        More bytes are needed than available.
    """
    if needed > available:
        raise InvalidMeshError(
            f"the file declares {vertices:,} vertices and {faces:,} faces, which take at least "
            f"{needed:,} bytes, but only {available:,} follow: it is truncated or damaged"
        )
