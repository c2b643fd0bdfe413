"""Meshes that nobody makes on purpose: each is described, or refused with its reason."""

import numpy as np
import pytest

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    octahedron,
    rectangle,
    scaled,
    tetrahedron,
    torus,
    translated,
    union,
)
from workers.errors import InvalidMeshError, ProteusError
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.geometry.views import View, named_view
from workers.retrieval.builtin import built_in_models
from workers.retrieval.model import describe


def stretched(mesh: TriangleMesh, factor: float) -> TriangleMesh:
    """The mesh with its x multiplied: needles where the factor is large."""
    return TriangleMesh(mesh.vertices * [factor, 1.0, 1.0], mesh.faces)


def needle_strip(cells: int, aspect: float) -> TriangleMesh:
    """A ribbon of width 1 whose triangles are so many times longer than wide."""
    i = np.arange(cells + 1)
    x, zero = i / aspect, np.zeros(cells + 1)
    vertices = np.stack([np.stack([x, zero, zero], 1), np.stack([x, zero + 1, zero], 1)], axis=1)
    a = 2 * i[:-1]
    faces = np.concatenate([np.stack([a, a + 1, a + 3], 1), np.stack([a, a + 3, a + 2], 1)])
    return TriangleMesh(vertices.reshape(-1, 3), faces)


def needle_soup(count: int, aspect: float) -> TriangleMesh:
    """Loose triangles in all directions, so many times longer than wide."""
    rng = np.random.default_rng(0)
    long, other = rng.normal(size=(2, count, 3))
    across = np.cross(long, other)
    across *= np.linalg.norm(long, axis=1)[:, None] / np.linalg.norm(across, axis=1)[:, None]
    first = rng.normal(size=(count, 3))
    corners = np.stack([first, first + long, first + across / aspect], axis=1)
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def caps(height: float) -> TriangleMesh:
    """A sphere whose triangles are cut in three at a point close to one side."""
    ball = icosphere(2)
    a, b, c = (ball.vertices[ball.faces[:, i]] for i in range(3))
    apex = np.arange(ball.n_faces) + ball.n_vertices
    points = (1 - height) * (a + b) / 2 + height * c
    faces = [np.stack([ball.faces[:, i], ball.faces[:, (i + 1) % 3], apex], 1) for i in range(3)]
    return TriangleMesh(np.concatenate([ball.vertices, points]), np.concatenate(faces))


def on_a_line(noise: float) -> TriangleMesh:
    """Fifty vertices on a line, or nearly."""
    i = np.arange(50)
    points = i[:, None] * [1.0, 2.0, 3.0] + noise * np.random.default_rng(0).normal(size=(50, 3))
    return TriangleMesh(points, np.stack([i[:-2], i[:-2] + 1, i[:-2] + 2], axis=1))


def wheel(faces: int, height: float) -> TriangleMesh:
    """One vertex that all faces share."""
    angle = 2 * np.pi * np.arange(faces) / faces
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    i = np.arange(faces)
    triangles = np.stack([0 * i, 1 + i, 1 + (i + 1) % faces], axis=1)
    return TriangleMesh(np.concatenate([[[0, 0, height]], rim]), triangles)


def moebius() -> TriangleMesh:
    """A band with one side."""
    n, k = 60, 5
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, np.linspace(-0.3, 0.3, k), indexing="ij")
    ring = 1 + v * np.cos(u / 2)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), v * np.sin(u / 2)], axis=2)
    faces = []
    for i in range(n):
        for j in range(k - 1):
            a, b = i * k + j, i * k + j + 1
            c, d = (b + k, a + k) if i < n - 1 else (k - 2 - j, k - 1 - j)
            faces += [[a, b, c], [a, c, d]]
    return TriangleMesh(points.reshape(-1, 3), np.array(faces))


def book(pages: int) -> TriangleMesh:
    """Rectangles around one spine: its edges have as many faces as there are pages."""
    page = rectangle(6, 6)
    turned = []
    for angle in 2 * np.pi * np.arange(pages) / pages:
        x, y = page.vertices[:, 0], page.vertices[:, 1]
        turned.append(np.stack([x * np.cos(angle), x * np.sin(angle), y], axis=1))
    return union(*(TriangleMesh(vertices, page.faces) for vertices in turned))


def random_faces(vertices: int, faces: int) -> TriangleMesh:
    """Faces between any vertices."""
    rng = np.random.default_rng(1)
    return TriangleMesh(rng.normal(size=(vertices, 3)), rng.integers(vertices, size=(faces, 3)))


def row_of(part: TriangleMesh, count: int) -> TriangleMesh:
    """So many copies side by side."""
    return union(*(translated(part, (3.0 * i, 0, 0)) for i in range(count)))


def spiky() -> TriangleMesh:
    """A sphere with spikes of every length up to ten thousand radii."""
    ball = icosphere(2)
    heights = 10.0 ** np.random.default_rng(2).uniform(-3, 4, size=(ball.n_vertices, 1))
    return TriangleMesh(ball.vertices * (1 + heights), ball.faces)


MESHES = {
    "ribbon of needles": needle_strip(200, 9e5),
    "soup of needles": needle_soup(200, 9e5),
    "soup of needles too thin": needle_soup(200, 2e6),
    "sphere of needles": stretched(icosphere(2), 1e6),
    "sphere of thinner needles": stretched(icosphere(2), 1e8),
    "rod": stretched(icosphere(2), 1e4),
    "coin": stretched(icosphere(2), 1e-6),
    "long torus": stretched(torus(30, 12), 3e5),
    "tall cylinder": TriangleMesh(cylinder(100, 1).vertices * [1, 1, 1e3], cylinder(100, 1).faces),
    "flat cylinder": stretched(cylinder(20, 2), 1e-5),
    "thin sheet": TriangleMesh(rectangle(9, 9).vertices * [1, 1e-6, 1], rectangle(9, 9).faces),
    "caps": caps(1e-5),
    "flatter caps": caps(2e-6),
    "line": on_a_line(0.0),
    "nearly a line": on_a_line(1e-7),
    "two sheets apart": union(rectangle(9, 9), translated(rectangle(9, 9), (0, 0, 1e-8))),
    "two sheets in one": union(rectangle(9, 9), translated(rectangle(9, 9), (0, 0, 1e-10))),
    "far from the origin": translated(bumpy_sphere(2), (1e8, 0, 0)),
    "farther from the origin": translated(bumpy_sphere(2), (1e14, 1e14, 0)),
    "flat wheel": wheel(400, 0.0),
    "cone": wheel(400, 1.0),
    "sixty small parts": row_of(octahedron(0.3), 60),
    "ninety parts of four faces": row_of(tetrahedron(), 90),
    "too many small parts": row_of(octahedron(0.3), 120),
    "moebius": moebius(),
    "book": book(9),
    "book of three": book(3),
    "tetrahedron": tetrahedron(),
    "four faces": rectangle(2, 1),
    "random faces": random_faces(200, 600),
    "all faces of a few vertices": random_faces(10, 300),
    "large and tiny": union(
        icosphere(2), translated(scaled(icosphere(2), 1e-4), (1.00005, 0, 0))
    ),
    "spiky": spiky(),
    **{
        f"in units of 1e{exponent}": scaled(bumpy_sphere(2), 10.0**exponent)
        for exponent in (-150, -99, -61, -59, 59, 61, 99, 150)
    },
}  # fmt: skip
COARSE = ("soup of needles", "random faces", "ninety parts of four faces")
"""Of 32 parts that are refined one by one; what comes of them is the same at 300 vertices."""
MODELS = {model.views[0].name: model for model in built_in_models() if len(model.views) == 1}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("view", ["closed", "open", "smooth", "smooth-open"])
def test_a_hostile_mesh_is_described_or_refused_with_a_reason(name: str, view: str) -> None:
    small = named_view(view, working_vertices=100 if name in COARSE else 300)
    try:
        solution = solve(clean(MESHES[name]).mesh, View(view, small.steps, 20))
    except ProteusError:
        return
    assert np.isfinite(solution.spectrum.eigenvalues).all()
    assert (solution.spectrum.eigenvalues > 0).all()
    if view not in MODELS:
        return
    try:
        descriptor = describe({view: solution}, MODELS[view])
    except ProteusError:
        return
    assert np.isfinite(descriptor).all()


@pytest.mark.parametrize("view", ["smooth", "smooth-open"])
def test_needles_that_smoothing_takes_away_are_refused_at_once(view: str) -> None:
    with pytest.raises(
        InvalidMeshError, match=r"left 0 of .* faces with area, expected at least 4"
    ):
        solve(clean(needle_soup(200, 9e5)).mesh, named_view(view))
