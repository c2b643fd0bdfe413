"""Open surfaces are closed: short boundary loops by caps, sheets by their own mirror image.

Holes are the largest single loss in retrieval. A hole differs from the rim of a scan by its length.
Lengths along the surface do not change with the pose; the shape of a loop in space does (decision
0008).
"""

import math

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.canonical import canonical_frame, canonical_order, reordered
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_edges, boundary_loops

RING_SPACING = np.sqrt(0.75)  # height of an equilateral triangle of edge 1

# Chosen, not measured; tests/geometry/test_closing.py bounds the triangles that come of them.
INNERMOST_RADIUS = 0.7  # in edges; the ring within is the centre itself
ALWAYS_UNIFORM = 36  # loops of at most so many edges: their caps are small
TIE = 2.0**-30  # of the way round a loop: nearer vertices count as side by side, despite rounding
GROWTH = 1.2  # of the edges from ring to ring where a uniform cap would be too large


def relative_length(mesh: TriangleMesh, loop: IntArray) -> float:
    """p² / A of a boundary loop of perimeter p on a surface of area A.

    4π for the rim of a flat disc, 16 for that of a square. Decision 0008 has it for holes, rims of
    masks, and outlines of what is seen from one side.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    loop : (l,) int64
        Vertex indices along the loop.

    Returns
    -------
    float
        Without unit, and the same in every pose.
    """
    points = mesh.vertices[loop]
    perimeter = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum()
    return float(perimeter**2 / mesh.area)


def close_loops(mesh: TriangleMesh, *, longest: float) -> TriangleMesh:
    """Mesh whose short boundary loops are closed.

    Each is filled by concentric rings to its centroid, with triangles about as long as its own
    edges. Copies that are rotated, scaled or renumbered get the same caps.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    longest : float
        Largest `relative_length` of a loop that is closed.

    Returns
    -------
    TriangleMesh
        The vertices and faces of the mesh stay the first ones, in their order. The mesh itself if
        there is nothing to close.
    """
    rim = boundary_edges(mesh)
    if len(rim) == 0:
        return mesh
    # Where a loop begins decides how its cap is cut. In canonical order copies begin alike.
    order = canonical_order(mesh, canonical_frame(mesh))
    loops = [order[loop] for loop in boundary_loops(reordered(mesh, order))]
    # A loop around one triangle is its rim: a cap would be that triangle again.
    lone = _triangles_on(mesh, np.unique(rim))
    closed = [
        loop
        for loop in loops
        if relative_length(mesh, loop) <= longest and tuple(sorted(loop.tolist())) not in lone
    ]
    # The mesh comes first, so that its vertices and faces keep their numbers; then cap after cap.
    vertices, faces = [mesh.vertices], [mesh.faces]
    n_vertices = mesh.n_vertices
    longest_uniform = _longest_uniform(mesh.n_vertices, closed)
    for loop in closed:
        growth = 1.0 if len(loop) <= longest_uniform else GROWTH
        inner, triangles = cap(mesh.vertices[loop], growth=growth)
        numbers = np.concatenate([loop, n_vertices + np.arange(len(inner))])
        vertices.append(inner)
        faces.append(numbers[triangles])
        n_vertices += len(inner)
    return TriangleMesh(np.concatenate(vertices), np.concatenate(faces)) if closed else mesh


def double(mesh: TriangleMesh, *, longest: float) -> TriangleMesh:
    """Sheet with its mirror image glued on along the boundary, at the same places.

    A sheet has a loop whose `relative_length` is above ``longest``. Any other mesh is returned as
    it is, also a body with the pinholes that simplification may leave. What is seen of a body from
    one side is a sheet. Its eigenfunctions are those of the body that are even from front to back;
    the doubled sheet has the odd ones too (decision 0008).

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    longest : float
        Largest `relative_length` of a loop of a body.

    Returns
    -------
    TriangleMesh
        The vertices and faces of the mesh stay the first ones. The image is wound the other way,
        and lacks the faces all of whose corners are on the boundary.
    """
    rim = np.unique(boundary_edges(mesh))
    lengths = [relative_length(mesh, loop) for loop in boundary_loops(mesh)]
    if max(lengths, default=0.0) <= longest:
        return mesh
    # The image shares the vertices of the rim and has copies of all others.
    image = np.arange(mesh.n_vertices)
    inner = np.setdiff1d(image, rim)
    image[inner] = mesh.n_vertices + np.arange(len(inner))
    # A face whose corners are all on the rim would come twice on the same vertices: left out.
    doubled = ~np.isin(mesh.faces, rim).all(axis=1)  # (m,)
    faces = image[mesh.faces[doubled]][:, ::-1]
    vertices = np.concatenate([mesh.vertices, mesh.vertices[inner]])
    return TriangleMesh(vertices, np.concatenate([mesh.faces, faces]))


def cap(points: FloatArray, *, growth: float = 1.0) -> tuple[FloatArray, IntArray]:
    """Vertices inside a loop (l, 3), and the triangles that fill it.

    Parameters
    ----------
    points : (l, 3) float64
        The loop in the winding of the faces outside of it.
    growth : float
        Factor from ring to ring of the triangles' edges; 1 gives about l²/4π vertices, more
        gives a multiple of l.

    Returns
    -------
    inner : (r, 3) float64
        Ring after ring, the centre last; empty for a loop of three, which is one triangle.
    triangles : (t, 3) int64
        Indices into the loop's points followed by the inner ones, wound against the loop.
    """
    n_points = len(points)
    if n_points == 3:
        return np.zeros((0, 3)), np.array([[2, 1, 0]])
    # Places on the loop run from 0 to 1 by length. Centre and radius weigh points by length, too,
    # so that a loop with some short edges has the same centre as one without.
    sides = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)  # (l,)
    perimeter = float(sides.sum())
    at = np.concatenate([[0.0], np.cumsum(sides)]) / perimeter  # (l + 1,), the last is 1
    weights = 0.5 * (sides + np.roll(sides, 1)) / perimeter
    centre = weights @ points  # (3,)
    radius = float(weights @ np.linalg.norm(points - centre, axis=1))
    around = np.concatenate([points, points[:1]]) - centre  # (l + 1, 3)

    # Rings from the loop inwards: shrunken copies of it, each one triangle's height nearer to the
    # centre, with as many evenly spaced vertices as make edges of the wanted length.
    edge = perimeter / n_points
    left = radius - RING_SPACING * edge
    outer_start, outer_at, n_vertices = 0, at[:-1], n_points
    inner, triangles = [], []
    while left >= INNERMOST_RADIUS * edge:
        edge *= growth
        shrink = left / radius
        # TIE keeps a copy whose rounding differs from another number of vertices.
        count = max(4, math.floor(perimeter * shrink / edge + 0.5 + TIE))
        ring_at = np.arange(count) / count
        ring = np.stack([np.interp(ring_at, at, around[:, axis]) for axis in range(3)], axis=1)
        inner.append(centre + shrink * ring)
        triangles.append(_band(outer_at, outer_start, ring_at, n_vertices))
        outer_start, outer_at = n_vertices, ring_at
        n_vertices += count
        left -= RING_SPACING * edge
    # The innermost ring is joined to the centre.
    last = outer_start + np.arange(len(outer_at))
    fan = np.stack([np.roll(last, -1), last, np.full(len(last), n_vertices)], axis=1)
    return np.concatenate([*inner, centre[None]]), np.concatenate([*triangles, fan])


def _band(
    outer_at: FloatArray, outer_start: int, inner_at: FloatArray, inner_start: int
) -> IntArray:
    """Triangles between two rings, given where on the loop (0 to 1) their vertices stand.

    Both rings are walked side by side; whoever has the nearer next vertex steps forward.
    """
    n_outer, n_inner = len(outer_at), len(inner_at)
    # All steps of both rings in the order of their ends; of two side by side the outer goes first.
    next_at = np.concatenate([outer_at[1:], [1.0], inner_at[1:], [1.0]])
    order = np.argsort(np.rint(next_at / TIE), kind="stable")
    outer_steps = order < n_outer
    outer_done: IntArray = np.cumsum(outer_steps) - outer_steps  # steps before this one
    inner_done: IntArray = np.cumsum(~outer_steps) - ~outer_steps
    outer = outer_start + outer_done % n_outer
    inner = inner_start + inner_done % n_inner
    outer_next = outer_start + (outer_done + 1) % n_outer
    inner_next = inner_start + (inner_done + 1) % n_inner
    # Each step makes a triangle: the edge stepped along, and the vertex where the other ring waits.
    third = np.where(outer_steps, outer_next, inner_next)
    return np.stack([third, outer, inner], axis=1)


def _triangles_on(mesh: TriangleMesh, vertices: IntArray) -> set[tuple[int, ...]]:
    """Sorted corners of the faces among these vertices: a cap must not repeat one of them."""
    among = np.zeros(mesh.n_vertices, dtype=np.bool_)
    among[vertices] = True
    faces = mesh.faces[among[mesh.faces].all(axis=1)]
    return {tuple(face) for face in np.sort(faces, axis=1).tolist()}


def _longest_uniform(n_vertices: int, loops: list[IntArray]) -> float:
    """Length of loop up to which uniform caps together have no more vertices than the mesh."""
    total = sum(len(loop) for loop in loops)
    return max(ALWAYS_UNIFORM, 4.0 * np.pi * n_vertices / max(total, 1))
