"""Kinds of MSH files of Gmsh, and of Medit's MESH."""

import struct

import numpy as np
from numpy.typing import ArrayLike

from tests.formats.kinds import BODY, Facts, kind, refused
from tests.formats.vtk_builders import TETRAHEDRA, WITH_MIDDLE

MSH, MEDIT = "Gmsh MSH", "Medit MESH"
N, M = BODY.n_vertices, BODY.n_faces
TAGS = np.arange(N) * 7 + 3
"""Numbers of nodes with gaps."""
THE_BOX = Facts(area=6.0, vertices=8)
BOX = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
HEXAHEDRON = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])


def rows(*columns: ArrayLike, first: ArrayLike | None = None) -> str:
    """Each row on a line, numbers of the row in front."""
    values = [np.asarray(column) for column in columns]
    numbers = np.arange(1, len(values[-1]) + 1) if first is None else np.asarray(first)
    lists = [np.atleast_2d(value.T).T.tolist() for value in (numbers, *values)]
    return "".join(
        " ".join(str(value) for part in parts for value in part) + "\n"
        for parts in zip(*lists, strict=True)
    )


def head(version: str, *, binary: bool = False) -> bytes:
    """Header section; byte orders follow in a binary file."""
    return f"$MeshFormat\n{version} {int(binary)} 8\n".encode()


def section(name: str, content: str) -> bytes:
    """A section."""
    return f"${name}\n{content}$End{name}\n".encode()


def plain(corners: ArrayLike, type: int) -> str:
    """Elements of version 2 with two tags."""
    table = np.asarray(corners)
    return rows(np.tile([type, 2, 0, 1], (len(table), 1)), table)


def version2(points: ArrayLike, elements: str, tags: ArrayLike | None = None) -> bytes:
    """File of version 2.2 in text."""
    nodes = rows(points, first=tags)
    return (
        head("2.2")
        + b"$EndMeshFormat\n"
        + section("PhysicalNames", '1\n2 1 "the $Nodes of skin"\n')
        + section("Nodes", f"{nodes.count(chr(10))}\n{nodes}")
        + section("Elements", f"{elements.count(chr(10))}\n{elements}")
    )


@kind(MSH, "version 2.2 in text, numbers of nodes with gaps", "Read.")
def text2() -> bytes:
    return version2(BODY.vertices, plain(TAGS[BODY.faces], 2), TAGS)


@kind(MSH, "CR LF line ends and comments", "Read.")
def windows() -> bytes:
    return section("Comments", "made by hand\n").replace(b"\n", b"\r\n") + text2().replace(
        b"\n", b"\r\n"
    )


@kind(
    MSH,
    "tetrahedra with the triangles, lines and points around them",
    "The boundary surface of the volume is read; points and lines are left out.",
    found=("1,280 volume cells", "1,280 faces that are also", "2 points and lines"),
)
def tetrahedra() -> bytes:
    elements = plain([[1]], 15) + plain([[1, 2]], 1) + plain(BODY.faces + 1, 2)
    return version2(WITH_MIDDLE, elements + plain(TETRAHEDRA + 1, 4))


@kind(
    MSH,
    "elements of higher order",
    "Read by their corners.",
)
def higher_order() -> bytes:
    middles = np.arange(3) + N + 1
    corners = np.column_stack([BODY.faces + 1, np.tile(middles, (M, 1))])
    return version2(np.vstack([BODY.vertices, np.eye(3)]), plain(corners, 9))


@kind(MSH, "hexahedra", "The boundary surface is read.", facts=THE_BOX)
def hexahedra() -> bytes:
    return version2(BOX, plain(HEXAHEDRON + 1, 5))


@kind(MSH, "version 1 ($NOD, $ELM)", "Read.")
def version1() -> bytes:
    nodes = rows(BODY.vertices)
    elements = rows(np.tile([2, 1, 1, 3], (M, 1)), BODY.faces + 1)
    text = f"$NOD\n{N}\n{nodes}$ENDNOD\n$ELM\n{M}\n{elements}$ENDELM\n"
    return text.encode()


def binary2(order: str) -> bytes:
    """File of version 2.2 in binary."""
    nodes = np.zeros(N, [("tag", f"{order}i4"), ("position", f"{order}f8", (3,))])
    nodes["tag"], nodes["position"] = TAGS, BODY.vertices
    half = M // 2
    elements = np.column_stack(
        [np.arange(1, M + 1), np.tile([0, 1], (M, 1)), TAGS[BODY.faces]]
    ).astype(f"{order}i4")
    block = struct.Struct(f"{order}3i").pack
    return (
        head("2.2", binary=True)
        + struct.pack(f"{order}i", 1)
        + f"\n$EndMeshFormat\n$Nodes\n{N}\n".encode()
        + nodes.tobytes()
        + f"\n$EndNodes\n$Elements\n{M}\n".encode()
        + block(2, half, 2)
        + elements[:half].tobytes()
        + b"".join(block(2, 1, 2) + row.tobytes() for row in elements[half:])
        + b"\n$EndElements\n"
    )


@kind(MSH, "version 2.2 in binary, little-endian", "Read.")
def binary2_little() -> bytes:
    return binary2("<")


@kind(MSH, "version 2.2 in binary, big-endian", "Read.")
def binary2_big() -> bytes:
    return binary2(">")


@kind(MSH, "version 4.1 in text, with coordinates on curves and surfaces", "Read.")
def text41() -> bytes:
    numbers = "\n".join(str(tag) for tag in TAGS)
    nodes = f"2 {N} 3 {TAGS[-1]}\n0 1 0 0\n2 1 1 {N}\n{numbers}\n"
    nodes += "".join(f"{x} {y} {z} 0.5 0.5\n" for x, y, z in BODY.vertices.tolist())
    elements = f"1 {M} 1 {M}\n2 1 2 {M}\n" + rows(TAGS[BODY.faces])
    file = head("4.1") + b"$EndMeshFormat\n" + section("Entities", "0 0 0 0\n")
    return file + section("Nodes", nodes) + section("Elements", elements)


@kind(MSH, "version 4.0 in text", "Read.")
def text40() -> bytes:
    nodes = f"1 {N}\n1 2 0 {N}\n" + rows(BODY.vertices, first=TAGS)
    elements = f"1 {M}\n1 2 2 {M}\n" + rows(TAGS[BODY.faces])
    file = head("4") + b"$EndMeshFormat\n"
    return file + section("Nodes", nodes) + section("Elements", elements)


def binary4(order: str, version: str) -> bytes:
    """File of version 4 in binary."""
    elements = np.column_stack([np.arange(1, M + 1), TAGS[BODY.faces]])
    sizes = struct.Struct(f"{order}{4 if version == '4.1' else 2}Q").pack
    block = struct.Struct(f"{order}3iQ").pack
    ends: tuple[int, ...] = ()
    if version == "4.1":
        ends = (1, 1)
        nodes = TAGS.astype(f"{order}u8").tobytes() + BODY.vertices.astype(f"{order}f8").tobytes()
        elements = elements.astype(f"{order}u8")
    else:
        table = np.zeros(N, [("tag", f"{order}i4"), ("position", f"{order}f8", (3,))])
        table["tag"], table["position"] = TAGS, BODY.vertices
        nodes = table.tobytes()
        elements = elements.astype(f"{order}i4")
    return b"".join(
        (
            *(head(version, binary=True), struct.pack(f"{order}i", 1)),
            *(b"\n$EndMeshFormat\n$Nodes\n", sizes(1, N, *ends), block(2, 1, 0, N), nodes),
            *(b"\n$EndNodes\n$Elements\n", sizes(1, M, *ends)),
            block(*((2, 1, 2) if version == "4.1" else (1, 2, 2)), M),
            *(elements.tobytes(), b"\n$EndElements\n"),
        )
    )


@kind(MSH, "version 4.1 in binary, little-endian", "Read.")
def binary41() -> bytes:
    return binary4("<", "4.1")


@kind(MSH, "version 4.1 in binary, big-endian", "Read.")
def binary41_big() -> bytes:
    return binary4(">", "4.1")


@kind(MSH, "version 4.0 in binary", "Read.")
def binary40() -> bytes:
    return binary4("<", "4.0")


@kind(
    MSH,
    "counts that are one off",
    "All nodes and elements of the file are read.",
    repairs=("declares 641 nodes, but has 642", "declares 1,281 elements, but has 1,280"),
)
def wrong_counts() -> bytes:
    file = text2().replace(b"$Nodes\n642", b"$Nodes\n641")
    return file.replace(b"$Elements\n1280", b"$Elements\n1281")


@refused(
    MSH, "version 3 and unknown ones", "Refused: save it as version 2.2 or 4.1.", reason="version 3"
)
def version3() -> bytes:
    return text2().replace(b"2.2 0 8", b"3.0 0 8")


@refused(MSH, "an element of an unknown type", "Refused.", reason="Gmsh's type 77")
def unknown_type() -> bytes:
    return version2(BODY.vertices, plain(BODY.faces + 1, 77))


@refused(MSH, "a file that ends early", "Refused.", reason="truncated")
def truncated() -> bytes:
    return text2()[:-4000].rpartition(b"\n")[0]


@refused(MSH, "a binary file that ends early", "Refused.", reason="truncated")
def truncated_binary() -> bytes:
    return binary41()[:-4000]


@refused(MSH, "an element of a node that is missing", "Refused.", reason="refers to node 1,")
def missing_node() -> bytes:
    return version2(BODY.vertices, plain(BODY.faces + 1, 2), TAGS)


def medit(*sections: tuple[str, ArrayLike], version: int = 2) -> bytes:
    """File of Medit in text; each row has a reference behind."""
    text = f"MeshVersionFormatted {version}\n# a comment\nDimension\n3\n"
    for name, values in sections:
        table = np.asarray(values).tolist()
        lines = [" ".join(str(value) for value in row) + " 0" for row in table]
        text += f"\n{name}\n{len(table)}\n" + "\n".join(lines) + "\n"
    return (text + "\nEnd\n").encode()


@kind(MEDIT, "triangles", "Read.")
def medit_triangles() -> bytes:
    edges = ("Edges", BODY.faces[:9, :2] + 1)
    return medit(("Vertices", BODY.vertices), edges, ("Triangles", BODY.faces + 1))


@kind(
    MEDIT,
    "tetrahedra and the triangles around them",
    "The boundary surface of the volume is read.",
    found=("1,280 volume cells",),
)
def medit_tetrahedra() -> bytes:
    file = medit(
        ("Vertices", WITH_MIDDLE),
        ("Triangles", BODY.faces + 1),
        ("Tetrahedra", TETRAHEDRA + 1),
    )
    return file.replace(b"\n", b"\r\n")


@kind(MEDIT, "hexahedra", "The boundary surface is read.", facts=THE_BOX)
def medit_hexahedra() -> bytes:
    return medit(("Vertices", BOX), ("Hexahedra", HEXAHEDRON + 1))


@refused(MEDIT, "a file that ends early", "Refused.", reason="truncated")
def medit_truncated() -> bytes:
    return medit_triangles()[:-400]


@refused(
    MEDIT, "binary (.meshb)", "Refused: write it as text (.mesh).", reason="a binary Medit mesh"
)
def meshb() -> bytes:
    return struct.pack("<5i", 1, 2, 3, 20, 3) + bytes(99)
