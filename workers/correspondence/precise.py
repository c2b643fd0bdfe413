"""From rows that are equal at corresponding points to points on faces."""

import numpy as np
from scipy import sparse

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.transfer import closest_barycentric


def points_on_faces(
    rows: FloatArray, corners: FloatArray, mesh: TriangleMesh, nearest: IntArray
) -> tuple[IntArray, FloatArray]:
    """Closest points to rows on the faces around the nearest vertices.

    The faces span triangles between the rows of their corners, in as many dimensions as the rows
    have (Ezuz, Ben-Chen 2017).

    Parameters
    ----------
    rows : (n, b) float64
        What is looked for.
    corners : (m, b) float64
        Rows of the mesh's vertices.
    mesh : TriangleMesh
        Of m vertices, each with at least one face.
    nearest : (n,) int64
        Vertex whose row is nearest to each row.

    Returns
    -------
    (n,) int64 and (n, 3) float64
        A face for each row, and barycentric coordinates in it.
    """
    around = _faces_of_vertices(mesh)
    counts = np.diff(around.indptr)[nearest]  # (n,)
    owner = np.repeat(np.arange(len(rows)), counts)  # (p,)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    face = around.indices[around.indptr[nearest][owner] + offset].astype(np.int64)
    at = mesh.faces[face]  # (p, 3)
    # Each triangle and its row are laid into space: lengths and angles are all that counts.
    gram = _products(corners, mesh, face)
    base = rows[owner] - corners[at[:, 0]]
    along = np.einsum("pb,pb->p", base, corners[at[:, 1]] - corners[at[:, 0]])
    across = np.einsum("pb,pb->p", base, corners[at[:, 2]] - corners[at[:, 0]])
    flat, foot = _laid_out(gram, along, across)
    weights = closest_barycentric(foot, flat)
    gaps = np.einsum("pc,pci->pi", weights, flat) - foot
    height = np.einsum("pb,pb->p", base, base) - np.einsum("pi,pi->p", foot, foot)
    squared = np.einsum("pi,pi->p", gaps, gaps) + np.maximum(height, 0.0)
    order = np.lexsort((face, squared, owner))
    best = order[np.cumsum(counts) - counts]  # the first of each row
    return face[best], weights[best]


def _products(corners: FloatArray, mesh: TriangleMesh, face: IntArray) -> FloatArray:
    """Products of both edges from the first corner, (p, 3): first, second, mixed."""
    first = corners[mesh.faces[:, 1]] - corners[mesh.faces[:, 0]]
    second = corners[mesh.faces[:, 2]] - corners[mesh.faces[:, 0]]
    pairs = ((first, first), (second, second), (first, second))
    products = np.stack([np.einsum("mb,mb->m", one, other) for one, other in pairs], axis=1)
    return products[face]


def _laid_out(
    products: FloatArray, along: FloatArray, across: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Corners (p, 3, 3) of flat triangles of the same shape, and the feet (p, 3) of the rows."""
    tiny = 1e-150
    length = np.sqrt(products[:, 0])
    safe = np.maximum(length, tiny)
    shift = products[:, 2] / safe
    height = np.sqrt(np.maximum(products[:, 1] - shift**2, 0.0))
    x = along / safe
    has_height = height > 1e-9 * np.sqrt(products[:, 1])
    rise = np.divide(across - x * shift, height, out=np.zeros_like(x), where=has_height)
    flat = np.zeros((len(products), 3, 3))
    flat[:, 1, 0] = length
    flat[:, 2, 0], flat[:, 2, 1] = shift, height
    return flat, np.stack([x, rise, np.zeros_like(x)], axis=1)


def _faces_of_vertices(mesh: TriangleMesh) -> sparse.csr_array:
    """The faces around each vertex, as the columns of its row."""
    faces = np.repeat(np.arange(mesh.n_faces), 3)
    shape = (mesh.n_vertices, mesh.n_faces)
    ones = np.ones(len(faces), dtype=np.int8)
    return sparse.csr_array(sparse.coo_array((ones, (mesh.faces.ravel(), faces)), shape=shape))
