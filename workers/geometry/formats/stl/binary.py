"""Binary STL: 50 bytes a triangle, as many as the header says or as there are.

Writers get the header wrong in many ways. So a reading must look like triangles before it is
preferred to what the header says.
"""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.stl.records import (
    COORDINATES,
    HEADER,
    RECORD,
    Layout,
    Records,
    declared_count,
    has_unit_normals,
    look_like_triangles,
    soup,
    walk,
)
from workers.geometry.formats.surfaces.polygons import require_faces

NEVER_WRITTEN = 1 << 28  # counts from here on (13 GB) are no counts
MISSING = 0.01  # part of the triangles that may be cut off at the file's end
PADDED = 52  # bytes of a record that a C compiler has filled up
COLOURS = re.compile(rb"\b(?:COLOR|MATERIAL)=")


def is_binary_stl(data: bytes) -> bool:
    """Whether the file is just as long as its number of triangles says, or holds triangles.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    bool
        False for a binary STL whose number is wrong and whose normals are 0.
    """
    if len(data) < HEADER:
        return False
    body = len(data) - HEADER
    if body == RECORD * declared_count(data):
        return True
    records = Layout(body // RECORD).records(data)
    if has_unit_normals(records) and look_like_triangles(records):
        return True
    others = _exact_layouts(data)
    return any(look_like_triangles(layout.records(data)) for layout in others)


def read_binary_stl(data: bytes, limits: MeshLimits) -> Reading:
    """Read a binary STL file.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most faces that are accepted.

    Returns
    -------
    Reading
        Three vertices of its own for each triangle, in the order of the file.

    Raises
    ------
    InvalidMeshError
        No triangles, or less than the header says where the file was cut.
    UploadTooLargeError
        Over the limits.
    """
    if len(data) < HEADER:
        raise InvalidMeshError(
            f"binary STL has at least {HEADER} bytes, the file has {len(data)}: it is truncated"
        )
    records, repairs = _records(data, limits)
    limits.check(faces=len(records))
    require_faces(0, len(records))
    with np.errstate(invalid="ignore"):  # NaN is cleaning's to report
        corners = records["corners"].astype(np.float64)  # (m, 3, 3)
    return Reading(soup(corners.reshape(-1, 3)), repairs=repairs, found=_found(data[:80], records))


def _records(data: bytes, limits: MeshLimits) -> tuple[Records, tuple[str, ...]]:
    """Triangles, and what is to be said of the way they lie."""
    count, body = declared_count(data), len(data) - HEADER
    plain = Layout(count)
    is_exact = body == RECORD * count
    if is_exact and look_like_triangles(plain.records(data)):
        return plain.records(data), ()
    for layout in _exact_layouts(data):
        if look_like_triangles(layout.records(data)):
            return layout.records(data), _of_layout(layout)
    if is_exact:
        return plain.records(data), ()
    if 0 < RECORD * count <= body:
        limits.check(faces=count)
        return _more_than_declared(data, count)
    return _fewer_than_declared(data, count, limits)


def _exact_layouts(data: bytes) -> list[Layout]:
    """Unusual layouts that make the file just as long as it is."""
    body = len(data) - HEADER
    layouts = []
    for order in "<>":
        count = declared_count(data, order)
        if count and body % count == 0:
            stride = body // count
            if stride in (COORDINATES, RECORD, PADDED):
                layouts.append(Layout(count, order, stride))
        if order == ">" and body == RECORD * declared_count(data):
            layouts.append(Layout(body // RECORD, order))
    return layouts


def _of_layout(layout: Layout) -> tuple[str, ...]:
    """Say what is unusual about a layout."""
    repairs = []
    if layout.order == ">":
        repairs.append("read the numbers with the high byte first, unlike STL")
    if layout.stride != RECORD:
        repairs.append(f"read {layout.stride} bytes a triangle, where STL has {RECORD}")
    return tuple(repairs)


def _more_than_declared(data: bytes, count: int) -> tuple[Records, tuple[str, ...]]:
    """Triangles of a file that goes on behind those that its header counts."""
    body = len(data) - HEADER
    places = walk(data, count)
    if places is not None:
        return _at(data, places), ("left out the bytes that follow each triangle",)
    whole = Layout(body // RECORD)
    if body % RECORD == 0 and look_like_triangles(whole.records(data, first=count)):
        return whole.records(data), (_counts(count, whole.count),)
    declared = Layout(count).records(data)
    if not look_like_triangles(declared, normals=False):
        raise InvalidMeshError(
            f"the content of the file does not look like the {count:,} triangles that its header "
            "declares; expected binary STL"
        )
    return declared, (f"left out {body - RECORD * count:,} bytes behind the last triangle",)


def _fewer_than_declared(
    data: bytes, count: int, limits: MeshLimits
) -> tuple[Records, tuple[str, ...]]:
    """Triangles of a file that ends before those that its header counts, or that counts none."""
    n_whole, rest = divmod(len(data) - HEADER, RECORD)
    if rest >= COORDINATES:  # only the attribute is missing
        data, n_whole, rest = data + bytes(RECORD - rest), n_whole + 1, 0
    limits.check(faces=n_whole)
    is_nonsense = count == 0 or count >= NEVER_WRITTEN
    for order in "<>":
        records = Layout(n_whole, order).records(data)
        if look_like_triangles(records):
            if rest and not is_nonsense and n_whole < (1.0 - MISSING) * count:
                raise InvalidMeshError(
                    f"the file declares {count:,} triangles, but ends within triangle "
                    f"{n_whole + 1:,}: it is truncated; save or copy it again"
                )
            return records, (*_of_layout(Layout(n_whole, order)), _counts(count, n_whole))
    if count == 0 and not rest and n_whole == 0:
        return Layout(0).records(data), ()
    raise InvalidMeshError(
        f"the file declares {count:,} triangles, which take {HEADER + RECORD * count:,} bytes, "
        f"but it has {len(data):,}: it is truncated or no STL"
    )


def _at(data: bytes, places: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> Records:
    """Triangles that begin at these places."""
    kind = Layout(0).records(data).dtype
    content = np.frombuffer(data, np.uint8)
    windows = np.lib.stride_tricks.sliding_window_view(content, RECORD)
    return windows[places].view(kind)[:, 0]


def _counts(declared: int, there: int) -> str:
    """Say that the header's count is wrong."""
    return f"the header counts {declared:,} triangles, but the file has {there:,}; read those"


def _found(header: bytes, records: Records) -> tuple[str, ...]:
    """Colours of triangles, as Magics and VisCAM write them."""
    attributes = records["attribute"] if "attribute" in (records.dtype.names or ()) else None
    if COLOURS.search(header) or (attributes is not None and (attributes & 0x8000).any()):
        return ("colours of triangles",)
    return ()
