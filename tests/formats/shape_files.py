"""Kinds of files whose bytes are right and whose shape is not: strays, seams, T-junctions."""

import numpy as np

from tests.formats.kinds import BODY, Facts, kind
from tests.meshes import box, rectangle, translated, triangle_soup, union
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh

FORMAT = "Any format"
FAR = "Faces are left out that lie 10,000 times as far away as everything else."
NOT_FINITE = "Faces at such vertices are left out, up to a tenth of all."


def with_stray(place: float, size: float) -> TriangleMesh:
    """The body and one triangle somewhere."""
    corners = place + size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    face = BODY.n_vertices + np.arange(3)
    return TriangleMesh(
        np.concatenate([BODY.vertices, corners]), np.concatenate([BODY.faces, [face]])
    )


def stl(mesh: TriangleMesh) -> bytes:
    """Binary STL of any coordinates."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(mesh.n_faces, dtype=record)
    records["corners"] = mesh.vertices[mesh.faces]
    return bytes(80) + np.uint32(mesh.n_faces).tobytes() + records.tobytes()


@kind(FORMAT, "a small stray triangle far away", FAR, repairs=("left out 1 face",))
def small_stray() -> bytes:
    return write(with_stray(1e9, 1.0), "off")


@kind(FORMAT, "a huge stray triangle far away", FAR, repairs=("left out 1 face",))
def huge_stray() -> bytes:
    return write(with_stray(3.4e37, 1e37), "ply")


@kind(FORMAT, "a triangle of NaN", NOT_FINITE, repairs=("1 face (0.078 % of all)",))
def nan_triangle() -> bytes:
    return stl(with_stray(np.nan, 1.0))


@kind(FORMAT, "infinite coordinates", NOT_FINITE, repairs=("1 face (0.078 % of all)",))
def infinite_triangle() -> bytes:
    return write(with_stray(np.inf, 1.0), "ply")


@kind(FORMAT, "NaN at vertices without faces", "Such vertices are dropped.")
def nan_without_faces() -> bytes:
    strange: FloatArray = np.full((7, 3), np.nan)
    return write(TriangleMesh(np.concatenate([BODY.vertices, strange]), BODY.faces), "ply")


@kind(FORMAT, "triangles that share no vertices", "Vertices in the same place are one.")
def soup() -> bytes:
    return write(triangle_soup(BODY), "obj")


SEAM = "Vertices along open edges that lie on each other are welded."
SIZE = float(np.linalg.norm(np.ptp(BODY.vertices, axis=0)))


def in_two() -> tuple[TriangleMesh, TriangleMesh]:
    """The body, cut in two; each part has all vertices."""
    first = BODY.vertices[BODY.faces].mean(axis=1)[:, 0] > 0.1
    return (
        TriangleMesh(BODY.vertices, BODY.faces[first]),
        TriangleMesh(BODY.vertices, BODY.faces[~first]),
    )


@kind(
    FORMAT,
    "two parts with a seam of 1e-5 of the length",
    SEAM,
    facts=Facts(tolerance=1e-4),
    repairs=("at most 1e-05",),
)
def seam() -> bytes:
    first, second = in_two()
    return stl(union(first, translated(second, (1e-5 * SIZE, 0.0, 0.0))))


@kind(FORMAT, "parts that were rounded in coordinates of their own", SEAM, repairs=("welded",))
def parts_of_their_own() -> bytes:
    first, second = in_two()
    moved = second.vertices - np.array([1.1, 0.3, -0.7])
    back = moved.astype(np.float32) + np.array([1.1, 0.3, -0.7])
    return write(union(first, TriangleMesh(back, second.faces)), "ply")


@kind(FORMAT, "corners one step of single precision off", SEAM, repairs=("welded",))
def single_steps() -> bytes:
    corners = triangle_soup(BODY)
    single = corners.vertices.astype(np.float32)
    off = np.random.default_rng(0).random(single.shape) < 0.02
    single[off] = np.nextafter(single[off], np.float32(9.0))
    return stl(TriangleMesh(single.astype(np.float64), corners.faces))


@kind(FORMAT, "all corners moved by 2e-7 of the length", SEAM, repairs=("welded 3,198 vertices",))
def jitter() -> bytes:
    corners = triangle_soup(BODY)
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, corners.vertices.shape)
    return write(TriangleMesh(corners.vertices + 2e-7 * SIZE * noise, corners.faces), "ply")


@kind(FORMAT, "four decimals, the last one off here and there", SEAM, repairs=("welded",))
def last_decimals() -> bytes:
    corners = triangle_soup(BODY)
    rounded = np.round(corners.vertices, 4)
    off = np.random.default_rng(0).random(rounded.shape) < 0.01
    rounded[off] += 1e-4
    return write(TriangleMesh(np.round(rounded, 4), corners.faces), "obj")


def split_on_one_side() -> TriangleMesh:
    """The body with a vertex on an edge of every tenth face."""
    vertices, faces = BODY.vertices.tolist(), []
    for number, (a, b, c) in enumerate(BODY.faces.tolist()):
        if number % 10:
            faces.append([a, b, c])
        else:
            faces += [[a, len(vertices), c], [len(vertices), b, c]]
            vertices.append((0.3 * BODY.vertices[a] + 0.7 * BODY.vertices[b]).tolist())
    return TriangleMesh(np.array(vertices), np.array(faces))


@kind(
    FORMAT,
    "T-junctions: a vertex that only divides one side of an edge",
    "The vertex is taken out, where this closes open edges.",
    repairs=("took out 128 vertices at T-junctions",),
)
def t_junctions() -> bytes:
    return stl(split_on_one_side())


def refined_on_one_side() -> TriangleMesh:
    """The body with four faces in the place of one, in its right half."""
    vertices, faces = BODY.vertices.tolist(), []
    for corners in BODY.faces.tolist():
        if BODY.vertices[corners].sum(axis=0)[0] < 0.0:
            faces.append(corners)
            continue
        a, b, c = corners
        ab, bc, ca = range(len(vertices), len(vertices) + 3)
        faces += [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        ends = BODY.vertices[[[a, b], [b, c], [c, a]]]
        vertices += (0.5 * ends.sum(axis=1)).tolist()
    return TriangleMesh(np.array(vertices), np.array(faces))


@kind(
    FORMAT,
    "T-junctions: smaller faces beside larger ones",
    "The larger face is split where a vertex lies on its edge, where this closes open edges.",
    facts=Facts(vertices=1_632),
    repairs=("split 48 edges at T-junctions",),
)
def smaller_faces() -> bytes:
    return stl(refined_on_one_side())


@kind(
    FORMAT,
    "two sides of a slit, such as lips",
    "Left open, unless it is closed within 1e-5 of the length.",
    facts=Facts(area=None, loops=2, vertices=None),
)
def slit() -> bytes:
    sheet = rectangle(8, 8)
    lips = np.array([39, 40, 41])
    faces = sheet.faces.copy()
    upper = sheet.vertices[faces].mean(axis=1)[:, 1] > 0.5
    lifted = np.isin(faces, lips) & upper[:, None]
    faces[lifted] += sheet.n_vertices - lips[0]
    return write(
        TriangleMesh(np.concatenate([sheet.vertices, sheet.vertices[lips] + [0, 1e-3, 0]]), faces),
        "off",
    )


@kind(
    FORMAT,
    "walls of two parts on each other",
    "They stay two parts: their faces do not continue each other.",
    facts=Facts(area=10.0, components=2, loops=2, vertices=16),
)
def walls() -> bytes:
    tub = TriangleMesh(box().vertices, box().faces[[0, 1, 4, 5, 6, 7, 8, 9, 10, 11]])
    return write(union(tub, translated(tub, (1.0 + 1e-6, 0.0, 0.0))), "ply")


@kind(
    FORMAT,
    "the same surface twice, as front and back",
    "One of both is left out if they are within a thousandth of the size everywhere.",
    repairs=("left out 1 shell that only doubled another one",),
)
def double_shell() -> bytes:
    inner = TriangleMesh(0.9998 * BODY.vertices, BODY.faces[:, ::-1])
    return stl(union(inner, BODY))
