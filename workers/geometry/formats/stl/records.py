"""The records of binary STL: how they lie in the file, and whether they look like triangles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, frozen
from workers.geometry.mesh import TriangleMesh

HEADER = 84  # 80 bytes of anything, then the number of triangles
RECORD = 50  # a normal and three corners in float32, and the length of what follows
COORDINATES = 48  # bytes of a record without that length
SAMPLE = 4096  # triangles that are looked at
MOST = 0.9  # of them must look like triangles
LARGEST, SMALLEST = 1e30, 1e-30  # coordinates; random bytes are beyond as often as not
NORMAL_ERROR = 0.05  # of length 1; some writers round to a few digits

Records = NDArray[np.void]


@dataclass(frozen=True)
class Layout:
    """How triangles lie in a file.

    Attributes
    ----------
    count : int
        How many there are.
    order : str
        "<" or ">", as numpy calls the order of bytes.
    stride : int
        Bytes from one triangle to the next.
    """

    count: int
    order: str = "<"
    stride: int = RECORD

    def records(self, data: bytes, *, first: int = 0) -> Records:
        """Return the triangles as they lie in the file.

        Parameters
        ----------
        data : bytes
            The whole file, long enough.
        first : int
            Triangles that are left out at the beginning.

        Returns
        -------
        (count - first,) records
            With ``normal``, ``corners`` and, where the file has it, ``attribute``.
        """
        names, formats = ["normal", "corners"], [("f4", 3), ("f4", (3, 3))]
        fields: list[tuple[str, object, int]] = [
            (name, np.dtype((self.order + kind, shape)), place)
            for name, (kind, shape), place in zip(names, formats, (0, 12), strict=True)
        ]
        if self.stride >= RECORD:
            fields.append(("attribute", np.dtype(self.order + "u2"), COORDINATES))
        kind = np.dtype(
            {
                "names": [name for name, _, _ in fields],
                "formats": [kind for _, kind, _ in fields],
                "offsets": [place for _, _, place in fields],
                "itemsize": self.stride,
            }
        )
        start = HEADER + first * self.stride
        return np.frombuffer(data, kind, count=self.count - first, offset=start)


def declared_count(data: bytes, order: str = "<") -> int:
    """Read the number of triangles of the header.

    Parameters
    ----------
    data : bytes
        Of at least 84 bytes.
    order : str
        Of bytes: "<" or ">".

    Returns
    -------
    int
        From 0 to 0xFFFFFFFF; often it is wrong.
    """
    return int.from_bytes(data[80:HEADER], "little" if order == "<" else "big")


def look_like_triangles(records: Records, *, normals: bool = True) -> bool:
    """Whether most of some sampled triangles have sensible corners, and normals of length 1 or 0.

    Parameters
    ----------
    records : (n,) records
        As `Layout.records` gives them.
    normals : bool
        Whether the normals count.

    Returns
    -------
    bool
        False where there are none. Bytes of anything else all but never look so.
    """
    if len(records) == 0:
        return False
    sample = records[np.linspace(0, len(records) - 1, min(SAMPLE, len(records))).astype(np.int64)]
    with np.errstate(all="ignore"):  # anything may be there
        corners = sample["corners"].astype(np.float64)  # (s, 3, 3)
        size = np.abs(corners)
        sensible = ((size == 0) | ((size > SMALLEST) & (size < LARGEST))).all(axis=(1, 2))
        if normals:
            sensible &= _are_normals(sample["normal"].astype(np.float64), corners)
        apart = (corners != corners[:, [1, 2, 0]]).any(axis=2).all(axis=1)
    return bool(sensible.mean() >= MOST and (sensible & apart).mean() >= 0.5)


def has_unit_normals(records: Records) -> bool:
    """Whether most of some sampled normals have length 1.

    Parameters
    ----------
    records : (n,) records
        As `Layout.records` gives them.

    Returns
    -------
    bool
        False where there are none.
    """
    if len(records) == 0:
        return False
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(records["normal"][:SAMPLE].astype(np.float64), axis=1)
        return bool((np.abs(lengths - 1.0) < NORMAL_ERROR).mean() >= MOST)


def soup(corners: FloatArray) -> TriangleMesh:
    """Make a mesh of separate triangles.

    Parameters
    ----------
    corners : (3m, 3) float64
        Triangle after triangle; nothing may write to them again.

    Returns
    -------
    TriangleMesh
        With three vertices of its own for each triangle.
    """
    return TriangleMesh(frozen(corners), frozen(np.arange(len(corners)).reshape(-1, 3)))


def _are_normals(normals: FloatArray, corners: FloatArray) -> BoolArray:
    """Whether each is of length 1 or 0, no number at all, or across its triangle, (s,)."""
    lengths = np.linalg.norm(normals, axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.abs((normals * across).sum(axis=1))
    parallel = along >= 0.99 * lengths * np.linalg.norm(across, axis=1)
    fine: BoolArray = (
        (lengths == 0)
        | np.isnan(normals).all(axis=1)
        | (np.abs(lengths - 1.0) < NORMAL_ERROR)
        | (parallel & (lengths > 0))
    )
    return fine


def walk(data: bytes, count: int) -> IntArray | None:
    """Find triangles that are each followed by as many bytes as its attribute says.

    Parameters
    ----------
    data : bytes
        The whole file.
    count : int
        How many triangles the header declares.

    Returns
    -------
    (count,) int64, or None where so many triangles do not end with the file.
        Where each begins.
    """
    stride = (len(data) - HEADER) // count
    if len(data) == HEADER + stride * count:
        lengths = Layout(count, stride=stride).records(data)["attribute"]
        if (lengths == stride - RECORD).all():
            return HEADER + stride * np.arange(count)
    places, place, end = [], HEADER, len(data)
    for _ in range(count):
        if place + RECORD > end:
            return None
        places.append(place)
        place += RECORD + data[place + COORDINATES] + 256 * data[place + COORDINATES + 1]
    return np.array(places, dtype=np.int64) if place == end else None
