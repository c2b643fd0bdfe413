"""Kinds of GIFTI files, and of BrainVISA's and MNI's meshes."""

import base64
import gzip
import struct
import zlib

import numpy as np
from numpy.typing import ArrayLike

from tests.formats.kinds import BODY, kind, refused

FORMAT, BRAINVISA, MNI = "GIFTI", "BrainVISA", "MNI (.obj)"
N, M = BODY.n_vertices, BODY.n_faces
DOCTYPE = '<!DOCTYPE GIFTI SYSTEM "http://www.nitrc.org/frs/download.php/115/gifti.dtd">\n'
CODES = {"FLOAT32": "f4", "FLOAT64": "f8", "INT32": "i4"}
TRANSFORM = (
    "<CoordinateSystemTransformMatrix><DataSpace>NIFTI_XFORM_UNKNOWN</DataSpace>"
    "<TransformedSpace>NIFTI_XFORM_TALAIRACH</TransformedSpace>"
    "<MatrixData>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1</MatrixData></CoordinateSystemTransformMatrix>"
)


def rows(values: ArrayLike) -> str:
    """Each row on a line."""
    table = np.asarray(values).tolist()
    return "".join(" ".join(str(value) for value in row) + "\n" for row in table)


def array(
    intent: str,
    values: ArrayLike,
    type: str,
    *,
    encoding: str = "GZipBase64Binary",
    order: str = "RowMajorOrder",
    endian: str = "LittleEndian",
    inside: str = "",
) -> str:
    """One DataArray."""
    table = np.asarray(values)
    flat = table.ravel(order="F" if order.startswith("Column") else "C")
    data = flat.astype((">" if endian.startswith("Big") else "<") + CODES[type]).tobytes()
    coded = {
        "ASCII": " ".join(str(value) for value in flat.tolist()),
        "Base64Binary": base64.b64encode(data).decode(),
        "GZipBase64Binary": base64.b64encode(zlib.compress(data)).decode(),
        "ExternalFileBinary": "",
    }[encoding]
    sizes = "".join(f' Dim{axis}="{size}"' for axis, size in enumerate(table.shape))
    return (
        f'<DataArray Intent="NIFTI_INTENT_{intent}" DataType="NIFTI_TYPE_{type}" '
        f'ArrayIndexingOrder="{order}" Dimensionality="{table.ndim}"{sizes} '
        f'Encoding="{encoding}" Endian="{endian}" ExternalFileName="" ExternalFileOffset="">\n'
        f"<MetaData/>{inside}<Data>{coded}</Data></DataArray>\n"
    )


def gifti(*arrays: str, doctype: str = DOCTYPE) -> bytes:
    """A file of arrays."""
    head = f'<?xml version="1.0" encoding="UTF-8"?>\n{doctype}<GIFTI Version="1.0"'
    body = "<MetaData/><LabelTable/>" + "".join(arrays)
    return f'{head} NumberOfDataArrays="{len(arrays)}">\n{body}</GIFTI>\n'.encode()


def surface(**options: str) -> tuple[str, str]:
    """The arrays of the body."""
    return (
        array("POINTSET", BODY.vertices, "FLOAT32", inside=TRANSFORM, **options),
        array("TRIANGLE", BODY.faces, "INT32", **options),
    )


@kind(
    FORMAT,
    "surface, packed by zlib, with a document type that names GIFTI's",
    "Read; coordinates stay as they are in the file, no transform is applied.",
)
def packed() -> bytes:
    return gifti(*surface())


@kind(FORMAT, "surface in text, without a document type", "Read.")
def text() -> bytes:
    return gifti(*surface(encoding="ASCII"), doctype="")


@kind(FORMAT, "surface in base64, big-endian", "Read.")
def base64_big_endian() -> bytes:
    return gifti(*surface(encoding="Base64Binary", endian="BigEndian"))


@kind(FORMAT, "column after column", "Read.")
def columns() -> bytes:
    return gifti(*surface(order="ColumnMajorOrder"))


@kind(FORMAT, "triangles before points", "Read.")
def triangles_first() -> bytes:
    return gifti(*reversed(surface()))


@kind(FORMAT, "packed by gzip, as some programs do", "Read.")
def by_gzip() -> bytes:
    data = base64.b64encode(gzip.compress(BODY.faces.astype("<i4").tobytes())).decode()
    points, triangles = surface()
    head, _, tail = triangles.partition("<Data>")
    return gifti(points, f"{head}<Data>{data}</Data>{tail.partition('</Data>')[2]}")


@kind(
    FORMAT,
    "several pointsets, and values",
    "The first pointset is read; the others and the values are named.",
    found=("2 pointsets, of which the first is read", "1 array of values"),
)
def several() -> bytes:
    points, triangles = surface()
    other = array("POINTSET", BODY.vertices * 3, "FLOAT32")
    return gifti(points, other, triangles, array("SHAPE", np.zeros(N), "FLOAT32"))


@refused(
    FORMAT,
    "values or labels without a surface (.func.gii, .shape.gii, .label.gii)",
    "Refused: upload the surface (.surf.gii) they belong to.",
    reason="has values ('SHAPE'), no surface",
)
def values() -> bytes:
    return gifti(array("SHAPE", np.zeros(N), "FLOAT32"))


@refused(
    FORMAT,
    "numbers in another file (ExternalFileBinary)",
    "Refused: convert it to one file.",
    reason="in another file",
)
def external() -> bytes:
    return gifti(*surface(encoding="ExternalFileBinary"))


@refused(
    FORMAT,
    "a document type that declares something itself",
    "Refused: entities could grow without bound.",
    reason="document type",
)
def entities() -> bytes:
    return gifti(*surface(), doctype='<!DOCTYPE GIFTI [<!ENTITY a "b">]>\n')


def brainvisa_rows(values: ArrayLike) -> str:
    """Rows in brackets."""
    table = np.asarray(values).tolist()
    return " ".join("(" + " ,".join(str(value) for value in row) + ")" for row in table)


@kind(BRAINVISA, ".mesh in text", "Read.")
def brainvisa_text() -> bytes:
    points, faces = brainvisa_rows(BODY.vertices), brainvisa_rows(BODY.faces)
    parts = ["ascii", "VOID", 3, 1, 0, N, points, N, points, 0, M, faces]
    return ("\n".join(str(part) for part in parts) + "\n").encode()


def brainvisa_binary(order: str, sign: bytes, *, steps: int = 1) -> bytes:
    """The body in binary."""
    points, faces = (
        values.astype(order + type).tobytes()
        for values, type in ((BODY.vertices, "f4"), (BODY.faces, "u4"))
    )
    four = struct.Struct(order + "I").pack
    head = b"binar" + sign + four(4) + b"VOID" + four(3) + four(steps)
    step = four(N) + points + four(N) + points + four(0) + four(M) + faces
    return head + b"".join(four(number) + step for number in range(steps))


@kind(BRAINVISA, ".mesh in binary, either byte order", "Read.")
def brainvisa_little() -> bytes:
    return brainvisa_binary("<", b"DCBA")


@kind(
    BRAINVISA,
    ".mesh of several time steps",
    "The first is read.",
    found=("2 time steps, of which the first is read",),
)
def brainvisa_big() -> bytes:
    return brainvisa_binary(">", b"ABCD", steps=2)


@refused(BRAINVISA, "a file that ends early", "Refused.", reason="it is truncated")
def brainvisa_truncated() -> bytes:
    return brainvisa_little()[:-9]


def mni(*colours: str) -> bytes:
    """The body as MNI's polygons."""
    ends = " ".join(str(3 * face) for face in range(1, M + 1))
    corners = " ".join(str(corner) for corner in BODY.faces.ravel().tolist())
    head = f"P 0.3 0.3 0.4 10 1 {N}\n"
    points = rows(BODY.vertices)
    return (f"{head}{points}\n{points}\n {M}\n {' '.join(colours)}\n{ends}\n\n{corners}\n").encode()


@kind(MNI, "polygons, one colour", "Read as MNI's, not as Wavefront's OBJ.", filename="gray.obj")
def mni_polygons() -> bytes:
    return mni("0 1 1 1 1")


@kind(
    MNI,
    "a colour for each vertex",
    "Read; the colours are left alone and named.",
    filename="gray.obj",
    found=("colours",),
)
def mni_colours() -> bytes:
    return mni("2", *["1 0 0 1"] * N)


@refused(MNI, "a file that ends early", "Refused.", reason="truncated", filename="gray.obj")
def mni_truncated() -> bytes:
    return mni("0 1 1 1 1")[:-99]


@kind(
    FORMAT,
    "encodings under the names of the first GIFTI library (GIFTI_ENCODING_B64GZ)",
    "Read.",
)
def old_names() -> bytes:
    data = gifti(*surface(endian="BigEndian")).replace(
        b'"GZipBase64Binary"', b'"GIFTI_ENCODING_B64GZ"'
    )
    return data.replace(b'"BigEndian"', b'"GIFTI_ENDIAN_BIG"')
