"""Implicit smoothing: the surface after backward steps of a heat flow, its own or its graph's."""

from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.edges import (
    component_labels,
    directed_edges,
    edge_lengths,
    symmetric_graph,
    undirected_edges,
)
from workers.geometry.elements import lumped_areas
from workers.geometry.factorisation import SymmetricFactor
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.shared_edges import SharedEdges

COARSE = 0.25  # of a vertex's share of the area: its mass, where that is more (decision 0011)
ITERATIVE_FROM = 40_000  # vertices; factors of 100,000 took 15 s, conjugate gradients 1, once
ROUGHNESS_TIME = 0.5  # in areas of a vertex: averages over its neighbours (decision 0016)
JITTER_TIME = 1.0  # in areas of a vertex; 0.5 and 2 tell noise as well, measured once

# Chosen, not measured.
FLATTEST = 1.0  # degrees: what is smaller is flat, so that rounding of flat faces is no noise
MOST_ITERATIONS = 2000
SHORTEST_EDGE = 1e-6  # in √A: shorter ones have vanished
SMALLEST_AREA = 1e-12  # of a vertex, as a share of the surface: what has vanished still has a place


def fair(mesh: TriangleMesh, *, time: float) -> TriangleMesh:
    """Surface after one step along its graph, as if all triangles were equilateral.

    V ← (M + t·L/√3)⁻¹ M V, where L is the graph Laplacian and M has the masses of the vertices. A
    mass is 1/n of n, or a fourth of the vertex's share of the area where that is more. So what is
    coarse beside something fine stays where it is. Where triangles are equilateral this is the step
    of `smooth`. The weights hardly depend on positions, so noise of any size is averaged as the
    clean surface is. `smooth` takes the areas and angles of the noisy triangles, and noise makes
    areas grow most where they are small (decision 0011). Fairing by the graph: Taubin 1995;
    implicit: Desbrun 1999.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no unreferenced vertex.
    time : float
        t >= 0, as a share of the surface area.

    Returns
    -------
    TriangleMesh
        The same faces; the mesh itself where t is 0. Unit, place and orientation do not matter.

    Raises
    ------
    InvalidRequestError
        The time is negative or not finite.
    """
    if not (np.isfinite(time) and time >= 0.0):
        raise InvalidRequestError(f"smoothing time is {time}, expected a finite number from 0")
    if time == 0.0:
        return mesh
    return _faired(mesh, time, iterative=mesh.n_vertices >= ITERATIVE_FROM)


def _faired(mesh: TriangleMesh, time: float, *, iterative: bool) -> TriangleMesh:
    """Surface after the step of `fair`; for ``iterative`` see `_step`."""
    n = mesh.n_vertices
    edges = undirected_edges(mesh)  # (e, 2)
    graph = symmetric_graph(edges, np.ones(len(edges)), n)
    degrees = np.bincount(edges.ravel(), minlength=n).astype(np.float64)
    laplacian = sparse.csc_array(sparse.diags_array(degrees) - graph)
    areas = lumped_areas(mesh.faces, mesh.face_areas, n)
    masses = np.maximum(1.0 / n, COARSE * areas / areas.sum())  # (n,)
    centre = mesh.vertices.mean(axis=0)
    flow = time / np.sqrt(3.0) * laplacian
    moved = _step(masses, flow, mesh.vertices - centre, iterative=iterative)
    return TriangleMesh(centre + moved, mesh.faces)


def roughness(mesh: TriangleMesh) -> float:
    """How much larger a surface is than it is once it was faired a little: ln(A / A').

    Noise makes a surface grow, several times over if it is as large as an edge. Averaging over
    neighbours takes it off; what shapes are made of is larger, and stays. Clean meshes have 0.03 to
    0.25, with noise of half an edge 0.3, of a whole one 0.8 (decision 0016). Scale and resolution
    hardly matter.

    Parameters
    ----------
    mesh : TriangleMesh
        A working mesh.

    Returns
    -------
    float
        Without unit; at least 0 but for rounding.
    """
    # So short a step moves vertices hardly farther than to their neighbours: conjugate gradients
    # end after some 20 steps, at a relative residual of 10⁻¹², and cost less than factors.
    faired = _faired(mesh, ROUGHNESS_TIME / mesh.n_vertices, iterative=True)
    return float(np.log(mesh.area / faired.area))


def median_angle(mesh: TriangleMesh) -> float:
    """Median angle between adjacent faces: how rough a mesh is.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.

    Returns
    -------
    float
        In degrees; 0 where no two faces share an edge.
    """
    shared = SharedEdges.of(mesh.faces, mesh.n_vertices)
    if len(shared.faces) == 0:
        return 0.0
    normals = mesh.face_normals
    normals /= np.maximum(lengths(normals), np.finfo(np.float64).tiny)[:, None]
    one, other = (normals[shared.faces[:, side]] for side in range(2))
    cosines = np.clip(np.einsum("ei,ei->e", one, other), -1.0, 1.0)
    return float(np.degrees(np.arccos(np.median(cosines))))


def jitter(mesh: TriangleMesh) -> float:
    """How many times flatter a mesh is once it was faired a little: noise is, shape is not.

    The median angle between faces before and after a step of fairing over an area of a vertex, a
    degree added to each. An angle alone tells no noise from curvature: a coarse clean mesh has
    larger angles than a fine noisy one. Clean creatures have 0.7 to 1.5, however coarse, and 21 of
    22 real meshes 0.5 to 1.6; scans have 2.7 to 3.9, noise up to 5 (decision 0036).

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.

    Returns
    -------
    float
        Without unit; scale and resolution hardly matter.
    """
    # So short a step costs a few conjugate gradients, as in `roughness`.
    faired = _faired(mesh, JITTER_TIME / mesh.n_vertices, iterative=True)
    return (median_angle(mesh) + FLATTEST) / (median_angle(faired) + FLATTEST)


def fair_rough(mesh: TriangleMesh, *, time: float, clean: float, rough: float) -> TriangleMesh:
    """Surface after `fair`, as far as it is rough; a clean one stays as it is.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    time : float
        Of the whole step, in units of the area.
    clean, rough : float
        `jitter` up to which nothing is done, and from which all is; in between the time grows in
        proportion.

    Returns
    -------
    TriangleMesh
        The mesh itself if it is not rough.
    """
    share = float(np.clip((jitter(mesh) - clean) / (rough - clean), 0.0, 1.0))
    return mesh if share == 0.0 else fair(mesh, time=share * time)


def smooth(mesh: TriangleMesh, *, time: float, steps: int = 1) -> TriangleMesh:
    """Surface after the modified mean curvature flow (Kazhdan, Solomon, Ben-Chen 2012).

    Each step is V ← (A + t·W)⁻¹ A V. A has the areas of the surface as it is by then, scaled to
    area 1. W stays that of the given surface, so that thin parts do not tear. One step is the
    implicit smoothing of Desbrun and others (1999). Noise goes first, then fingers and handles,
    then limbs.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no zero-area face, no unreferenced vertex.
    time : float
        t >= 0, as a share of the surface area.
    steps : int
        At least 0.

    Returns
    -------
    TriangleMesh
        The same faces, some of which may have next to no area, but for what shrank to a point (a
        bubble that hung on one vertex): its vertices have no faces any more. The mesh itself where
        nothing is to be done. Unit, place and orientation do not matter; the centre of mass and
        the unit stay.

    Raises
    ------
    InvalidRequestError
        The time is negative or not finite, or there are fewer than 0 steps.
    InvalidMeshError
        A face has no area.
    """
    if not (np.isfinite(time) and time >= 0.0) or steps < 0:
        raise InvalidRequestError(
            f"smoothing time is {time} and steps are {steps}, expected finite numbers from 0"
        )
    if time == 0.0 or steps == 0:
        return mesh
    length = np.sqrt(mesh.area)
    centre = mesh.vertices.mean(axis=0)
    laplacian = mesh_laplacian(mesh)
    vertices = (mesh.vertices - centre) / length  # (n, 3)
    areas = laplacian.areas / laplacian.areas.sum()  # (n,)
    for step in range(steps):
        if step > 0:
            flowed = TriangleMesh(vertices, mesh.faces)
            areas = lumped_areas(mesh.faces, flowed.face_areas, mesh.n_vertices)
            total = areas.sum()
            vertices, areas = vertices / np.sqrt(total), areas / total
            length *= np.sqrt(total)
            areas = np.maximum(areas, SMALLEST_AREA)
        iterative = mesh.n_vertices >= ITERATIVE_FROM
        vertices = _step(areas, time * laplacian.stiffness, vertices, iterative=iterative)
    return TriangleMesh(centre + length * vertices, _without_points(vertices, mesh.faces))


def _without_points(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Faces of a surface of about area 1 where vertices that lie together are one, the first."""
    edges = directed_edges(faces)  # (3m, 2)
    short = edges[edge_lengths(vertices, edges) < SHORTEST_EDGE]
    if len(short) == 0:
        return faces
    labels = component_labels(short, len(vertices))
    _, first = np.unique(labels, return_index=True)  # of each component, which are 0, 1, …
    joined = first[labels][faces]  # (m, 3)
    a, b, c = joined.T
    kept: IntArray = joined[(a != b) & (b != c) & (c != a)]
    return kept


def _step(
    masses: FloatArray, flow: sparse.csc_array, vertices: FloatArray, *, iterative: bool
) -> FloatArray:
    """Vertices (n, 3) after a backward step: (M + F)⁻¹ M V, of a positive definite system.

    Factors of large meshes fill in: there the same is found by conjugate gradients, and by factors
    only where these do not end. So it is where ``iterative`` asks for it.
    """
    system = sparse.csc_array(sparse.diags_array(masses) + flow)
    right = masses[:, None] * vertices
    if iterative:
        scaling = sparse.diags_array(1.0 / system.diagonal())
        solve = partial(cg, system, rtol=1e-12, atol=0.0, maxiter=MOST_ITERATIONS, M=scaling)
        found = [solve(right[:, axis], x0=vertices[:, axis]) for axis in range(3)]
        if all(outcome == 0 for _, outcome in found):
            return np.stack([column for column, _ in found], axis=1)
    # Diagonal pivots would do. Others are taken where cotangents are large, in one step of eight on
    # transformed creatures, and move the last bits: `PREPARATION_VERSION` stands for these.
    return SymmetricFactor(system, pivot_threshold=1.0).solve(right)
