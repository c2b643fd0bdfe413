"""Meshes whose area, topology or spectrum is known in closed form, and ways to disguise them."""

import json

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh


def tetrahedron(edge: float = 1.0) -> TriangleMesh:
    """Regular tetrahedron, outward winding; area √3 edge²."""
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    return TriangleMesh(vertices * (edge / np.sqrt(8.0)), faces)


def single_triangle() -> TriangleMesh:
    """One triangle with legs of length 1; area 1/2."""
    return TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))


def octahedron(radius: float = 1.0) -> TriangleMesh:
    """Regular octahedron, outward winding."""
    vertices = np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
    )
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return TriangleMesh(radius * vertices, np.array(faces))


def icosahedron(radius: float = 1.0) -> TriangleMesh:
    """Regular icosahedron, outward winding."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    rows = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            rows += [[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]
    vertices = np.array(rows) * (radius / np.hypot(1.0, golden))
    edge = 2.0 * radius / np.hypot(1.0, golden)
    faces = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                lengths = np.linalg.norm(vertices[[i, j, k]] - vertices[[j, k, i]], axis=1)
                if np.allclose(lengths, edge):
                    volume = np.linalg.det(vertices[[i, j, k]])
                    faces.append([i, j, k] if volume > 0 else [i, k, j])
    return TriangleMesh(vertices, np.array(faces))


def subdivided(mesh: TriangleMesh, levels: int = 1) -> TriangleMesh:
    """Every triangle cut into four at its edges' midpoints; the surface stays the same."""
    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(levels):
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)  # (3m, 2)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(vertices)  # (m, 3): of edges 01, 12, 20
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        faces = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    return TriangleMesh(vertices, faces)


def icosphere(subdivisions: int, radius: float = 1.0) -> TriangleMesh:
    """Sphere of 10·4^s + 2 vertices; λ = l(l+1)/radius² with multiplicity 2l + 1."""
    mesh = icosahedron()
    for _ in range(subdivisions):
        mesh = subdivided(mesh)
        mesh = TriangleMesh(
            mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True), mesh.faces
        )
    return TriangleMesh(radius * mesh.vertices, mesh.faces)


def _grid_faces(rows: int, columns: int, *, wrap_rows: bool, wrap_columns: bool) -> IntArray:
    """Two triangles a cell of a grid of vertices numbered row by row, (m, 3)."""
    last_row = rows if wrap_rows else rows - 1
    last_column = columns if wrap_columns else columns - 1
    i, j = (g.ravel() for g in np.meshgrid(range(last_row), range(last_column), indexing="ij"))
    up, right = (i + 1) % rows, (j + 1) % columns
    a, b = i * columns + j, i * columns + right
    c, d = up * columns + right, up * columns + j
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def rectangle(nx: int, ny: int, a: float = 1.0, b: float = 1.0) -> TriangleMesh:
    """Flat [0, a] by [0, b] of nx by ny cells; Neumann λ = π² (p²/a² + q²/b²)."""
    y, x = np.meshgrid(np.linspace(0, b, ny + 1), np.linspace(0, a, nx + 1), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return TriangleMesh(vertices, _grid_faces(ny + 1, nx + 1, wrap_rows=False, wrap_columns=False))


def bent_rectangle(
    nx: int, ny: int, a: float = 1.0, b: float = 1.0, *, angle: float = 1.0
) -> TriangleMesh:
    """`rectangle`, folded by angle/nx along each line of constant x: exactly isometric."""
    flat = rectangle(nx, ny, a, b)
    headings = angle * np.arange(nx) / nx
    steps = (a / nx) * np.stack([np.cos(headings), np.sin(headings)], axis=1)  # (nx, 2)
    profile = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])  # (nx + 1, 2)
    column = np.tile(np.arange(nx + 1), ny + 1)
    vertices = np.stack([profile[column, 0], flat.vertices[:, 1], profile[column, 1]], axis=1)
    return TriangleMesh(vertices, flat.faces)


def flat_torus_corners(
    nx: int, ny: int, a: float = 1.0, b: float = 1.0
) -> tuple[FloatArray, IntArray, int]:
    """Flat torus a by b of nx by ny vertices as unwrapped corners (m, 3, 2), faces, n_vertices.

    Exact λ = 4π² (p²/a² + q²/b²) over all integers p, q.
    """
    faces = _grid_faces(ny, nx, wrap_rows=True, wrap_columns=True)  # (m, 3)
    row, column = faces // nx, faces % nx
    row = np.where((row == 0) & (row.max(axis=1, keepdims=True) == ny - 1), ny, row)
    column = np.where((column == 0) & (column.max(axis=1, keepdims=True) == nx - 1), nx, column)
    corners = np.stack([column * (a / nx), row * (b / ny)], axis=2)  # (m, 3, 2)
    return corners, faces, nx * ny


def torus(n_around: int, n_across: int, radius: float = 1.0, tube: float = 0.4) -> TriangleMesh:
    """Torus in space, Euler characteristic 0; area tends to 4π² radius · tube."""
    u, v = np.meshgrid(
        2 * np.pi * np.arange(n_around) / n_around,
        2 * np.pi * np.arange(n_across) / n_across,
        indexing="ij",
    )
    ring = radius + tube * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], axis=2)
    faces = _grid_faces(n_around, n_across, wrap_rows=True, wrap_columns=True)
    return TriangleMesh(vertices.reshape(-1, 3), faces[:, ::-1])


def cylinder(n_around: int, n_along: int, radius: float = 1.0, height: float = 2.0) -> TriangleMesh:
    """Open cylinder about z with two boundary loops of n_around edges."""
    z, u = np.meshgrid(
        np.linspace(0, height, n_along + 1),
        2 * np.pi * np.arange(n_around) / n_around,
        indexing="ij",
    )
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), z], axis=2).reshape(-1, 3)
    return TriangleMesh(
        vertices, _grid_faces(n_along + 1, n_around, wrap_rows=False, wrap_columns=True)
    )


def box(width: float = 1.0, depth: float = 1.0, height: float = 1.0) -> TriangleMesh:
    """Box of 8 vertices and 12 triangles with a corner at the origin, outward winding."""
    corners = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    faces = [triangle for a, b, c, d in quads for triangle in ([a, b, c], [a, c, d])]
    return TriangleMesh(np.array(corners) * np.array([width, depth, height]), np.array(faces))


def bumpy_sphere(subdivisions: int = 3, seed: int = 0) -> TriangleMesh:
    """Sphere with random smooth bumps: no symmetry, so its eigenvalues are simple."""
    sphere = icosphere(subdivisions)
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(7, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    heights = rng.uniform(0.2, 0.7, size=7)
    bumps = np.exp(4.0 * (sphere.vertices @ directions.T - 1.0)) @ heights  # (n,)
    stretch = np.array([1.0, 1.3, 0.8])
    return TriangleMesh(sphere.vertices * (1.0 + bumps)[:, None] * stretch, sphere.faces)


def union(*meshes: TriangleMesh) -> TriangleMesh:
    """All meshes as one, without merging any vertex."""
    offsets = np.cumsum([0] + [mesh.n_vertices for mesh in meshes[:-1]])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]
    return TriangleMesh(np.concatenate([m.vertices for m in meshes]), np.concatenate(faces))


def translated(mesh: TriangleMesh, offset: tuple[float, float, float]) -> TriangleMesh:
    """The mesh moved by an offset."""
    return TriangleMesh(mesh.vertices + np.array(offset), mesh.faces)


def scaled(mesh: TriangleMesh, factor: float) -> TriangleMesh:
    """The mesh with all lengths multiplied by factor."""
    return TriangleMesh(factor * mesh.vertices, mesh.faces)


def random_rotation(rng: np.random.Generator) -> FloatArray:
    """Draw a rotation matrix (3, 3), uniform over all rotations."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    rotation: FloatArray = q * np.sign(np.linalg.det(q))
    return rotation


def rotated(mesh: TriangleMesh, rng: np.random.Generator) -> TriangleMesh:
    """The mesh under a random rotation about the origin."""
    return TriangleMesh(mesh.vertices @ random_rotation(rng).T, mesh.faces)


def renumbered(mesh: TriangleMesh, rng: np.random.Generator) -> tuple[TriangleMesh, IntArray]:
    """The mesh with vertices and faces shuffled; new vertex i is old vertex order[i]."""
    order = rng.permutation(mesh.n_vertices)  # (n,)
    new_index = np.argsort(order)
    faces = rng.permutation(new_index[mesh.faces])
    return TriangleMesh(mesh.vertices[order], faces), order


def triangle_soup(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh as STL stores it: three vertices of its own for every triangle."""
    return TriangleMesh(
        mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3)
    )


def gltf_with_buffer(mesh: TriangleMesh, name: str = "scene.bin") -> tuple[bytes, bytes]:
    """A .gltf file and the file that holds its vertices and faces; it names a picture too."""
    points, corners = mesh.vertices.astype("<f4"), mesh.faces.astype("<u4")
    binary = points.tobytes() + corners.tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": name, "byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"}
            | {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()},
            {"bufferView": 1, "componentType": 5125, "count": corners.size, "type": "SCALAR"},
        ],
        "images": [{"uri": "missing.png"}],
    }
    return json.dumps(document).encode(), binary
