"""A glTF file and the files that it refers to, as they lie in one folder or archive."""

import posixpath
from collections import Counter
from collections.abc import Callable, Sequence

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.containers.clutter import ending_of
from workers.geometry.formats.containers.members import Member
from workers.geometry.formats.gltf.packing import pack_glb, referenced_files

GLTF_ENDINGS = frozenset({"gltf", "glb"})


class Neighbours:
    """Files that lie beside a glTF file, found by their paths.

    Parameters
    ----------
    members : sequence of Member
        All files; those that are refused are not found.
    """

    def __init__(self, members: Sequence[Member]) -> None:
        self.members = members
        self._places: dict[str, int] = {}
        self._folded: dict[str, int] = {}
        self._names: dict[str, int] = {}
        there = [n for n, member in enumerate(members) if member.refusal is None]
        paths = {number: posixpath.normpath(members[number].path) for number in there}
        counts = Counter(posixpath.basename(path).casefold() for path in paths.values())
        for number, path in paths.items():
            self._places.setdefault(path, number)
            self._folded.setdefault(path.casefold(), number)
            name = posixpath.basename(path).casefold()
            if counts[name] == 1:
                self._names[name] = number

    def find(self, path: str, reference: str) -> int | None:
        """Find what a file refers to.

        Parameters
        ----------
        path : str
            Of the file that refers.
        reference : str
            Relative to its folder; it may go up, but not out of the archive.

        Returns
        -------
        int or None
            Place among the members: of the same path, or of the same but for upper and lower
            case, or of the only file with this name.
        """
        folder = posixpath.dirname(posixpath.normpath(path))
        target = posixpath.normpath(posixpath.join(folder, reference.replace("\\", "/")))
        if target.startswith(("../", "/")):
            return None
        for known, key in (
            (self._places, target),
            (self._folded, target.casefold()),
            (self._names, posixpath.basename(target).casefold()),
        ):
            if key in known:
                return known[key]
        return None


def with_its_files(
    path: str,
    document: bytes,
    neighbours: Neighbours,
    read: Callable[[int], bytes],
    *,
    largest: int,
) -> bytes | None:
    """Join a glTF file and the files that it refers to as one GLB.

    Parameters
    ----------
    path : str
        Of the glTF file.
    document : bytes
        Its content.
    neighbours : Neighbours
        What lies beside it.
    read : function
        Reads a neighbour by its place.
    largest : int
        Most bytes of all of them together.

    Returns
    -------
    bytes or None
        None where it refers to no file, is no glTF, or lacks a file that it needs: reading it as
        it is says what is wrong.

    Raises
    ------
    UploadTooLargeError
        They have more bytes than the limit.
    """
    if ending_of(path) not in GLTF_ENDINGS:
        return None
    try:
        references = referenced_files(document)
        places = {name: neighbours.find(path, name) for name in references}
        found = {name: place for name, place in places.items() if place is not None}
        if not found:
            return None
        total = sum(neighbours.members[place].size for place in set(found.values()))
        if total + len(document) > largest:
            raise UploadTooLargeError(
                f"the glTF file and what it refers to have {total + len(document)} bytes, "
                f"allowed are {largest}"
            )
        contents = {place: read(place) for place in set(found.values())}
        return pack_glb(document, {name: contents[place] for name, place in found.items()})
    except (InvalidMeshError, UnsupportedFormatError):
        return None
