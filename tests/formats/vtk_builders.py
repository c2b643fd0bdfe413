"""Makes VTK files of `BODY`, legacy and XML, in every encoding."""

import base64
import lzma
import struct
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from tests.formats.kinds import BODY

TYPES = {"int": "i4", "float": "f4", "double": "f8", "vtktypeint64": "i8"}
TETRAHEDRA = np.column_stack([BODY.faces, np.full(BODY.n_faces, BODY.n_vertices)])
"""From each face to the middle, which becomes the last vertex."""
WITH_MIDDLE = np.vstack([BODY.vertices, BODY.vertices.mean(axis=0)])


def rows(values: ArrayLike, end: str = "\n") -> str:
    """Each row on a line."""
    table = np.atleast_2d(np.asarray(values))
    return "".join(" ".join(str(value) for value in row) + end for row in table.tolist())


def counted(corners: ArrayLike) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Put the number of corners in front of each row."""
    table = np.asarray(corners)
    return np.column_stack([np.full(len(table), table.shape[1]), table])


def text(*sections: str, version: str = "3.0", title: str = "a body", end: str = "\n") -> bytes:
    """Legacy file in text."""
    head = f"# vtk DataFile Version {version}\n{title}\nASCII\n"
    return (head + "\n".join(sections)).replace("\n", end).encode()


def points(values: ArrayLike = BODY.vertices, type: str = "double") -> str:
    """Section of points in text."""
    return f"POINTS {len(np.asarray(values))} {type}\n{rows(values)}"


def polygons(corners: ArrayLike = BODY.faces, name: str = "POLYGONS") -> str:
    """Section of cells in text, as before version 5."""
    table = counted(corners)
    return f"{name} {len(table)} {table.size}\n{rows(table)}"


def block(
    keyword: str, values: ArrayLike, type: str, *, order: str = ">", end: str = "\n"
) -> bytes:
    """Section of a binary file."""
    return (
        keyword.encode()
        + b"\n"
        + np.asarray(values).astype(order + TYPES[type]).tobytes()
        + (end.encode())
    )


def binary(*blocks: bytes, dataset: str = "POLYDATA", version: str = "3.0") -> bytes:
    """Legacy file in binary."""
    head = f"# vtk DataFile Version {version}\na body\nBINARY\nDATASET {dataset}\n"
    return head.encode() + b"".join(blocks)


def binary_body(*, type: str = "float", order: str = ">", end: str = "\n") -> bytes:
    """The body as binary polygons."""
    n, m = BODY.n_vertices, BODY.n_faces
    return binary(
        block(f"POINTS {n} {type}", BODY.vertices, type, order=order, end=end),
        block(f"POLYGONS {m} {4 * m}", counted(BODY.faces), "int", order=order, end=end),
    )


Pack = Callable[[bytes], bytes]
PACKERS: dict[str, Pack] = {
    "vtkZLibDataCompressor": zlib.compress,
    "vtkLZMADataCompressor": lzma.compress,
}


class Xml:
    """Writes arrays of a VTK XML file in one encoding."""

    def __init__(
        self,
        format: str = "ascii",
        *,
        order: str = "<",
        header: str = "UInt32",
        compressor: str = "",
        appended: str = "raw",
        block: int = 4096,
    ) -> None:
        self.format, self.order, self.header = format, order, header
        self.compressor, self.appended, self.block = compressor, appended, block
        self.section = b""

    def sizes(self, *values: int) -> bytes:
        """Sizes in front of an array."""
        return struct.pack(
            f"{self.order}{len(values)}{'I' if self.header == 'UInt32' else 'Q'}", *values
        )

    def content(self, data: bytes) -> tuple[bytes, bytes]:
        """Sizes and bytes of an array."""
        if not self.compressor:
            return self.sizes(len(data)), data
        pack = PACKERS[self.compressor]
        packed = [pack(data[i : i + self.block]) for i in range(0, len(data), self.block)]
        sizes = [len(packed), self.block, len(data) % self.block, *map(len, packed)]
        return self.sizes(*sizes), b"".join(packed)

    def array(
        self, name: str, values: ArrayLike, type: str = "Float64", components: int = 1
    ) -> str:
        """One DataArray element."""
        head = f'<DataArray type="{type}" Name="{name}" NumberOfComponents="{components}"'
        if self.format == "ascii":
            return f'{head} format="ascii">\n{rows(np.ravel(values))}</DataArray>\n'
        code = {"Float": "f", "Int": "i", "UInt": "u"}[type.rstrip("0123456789")]
        width = int(type.lstrip("FloatUIn")) // 8
        data = np.asarray(values).astype(f"{self.order}{code}{width}").tobytes()
        sizes, content = self.content(data)
        if self.compressor:
            coded = base64.b64encode(sizes) + base64.b64encode(content)
        else:
            coded = base64.b64encode(sizes + content)
        if self.format == "binary":
            return f'{head} format="binary">\n  {coded.decode()}\n</DataArray>\n'
        offset = len(self.section)
        self.section += coded if self.appended == "base64" else sizes + content
        return f'{head} format="appended" offset="{offset}"/>\n'

    def file(self, dataset: str, *pieces: str, version: str = "1.0") -> bytes:
        """Return the file around the pieces."""
        order = "LittleEndian" if self.order == "<" else "BigEndian"
        packed = f' compressor="{self.compressor}"' if self.compressor else ""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="{dataset}" version="{version}" '
            f'byte_order="{order}" header_type="{self.header}"{packed}>\n<{dataset}>\n'
        )
        end = b""
        if self.section:
            end = f'<AppendedData encoding="{self.appended}">\n_'.encode()
            end += self.section + b"\n</AppendedData>\n"
        middle = "".join(pieces) + f"</{dataset}>\n"
        return head.encode() + middle.encode() + end + b"</VTKFile>\n"

    def points(self, values: ArrayLike = BODY.vertices) -> str:
        """Points of a piece."""
        return f"<Points>{self.array('Points', values, 'Float64', 3)}</Points>"

    def polys(self, corners: ArrayLike = BODY.faces, name: str = "Polys") -> str:
        """Polygons of a piece."""
        table = np.asarray(corners)
        offsets = np.arange(1, len(table) + 1) * table.shape[1]
        return (
            f"<{name}>{self.array('connectivity', table, 'Int64')}"
            f"{self.array('offsets', offsets, 'Int64')}</{name}>"
        )

    def piece(self, *sections: str, n_points: int = BODY.n_vertices) -> str:
        """One piece."""
        return f'<Piece NumberOfPoints="{n_points}">' + "".join(sections) + "</Piece>\n"

    def body(self) -> bytes:
        """The body as polygons."""
        return self.file("PolyData", self.piece(self.points(), self.polys()))
