"""Evenly spread, area-weighted sample points that pose, scale and numbering do not move."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.sparse.linalg import spsolve_triangular

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.edges import length_graph, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum

SAMPLES = 800
"""Points that stand for a shape unless a channel asks for another number of them.

Moments over them are exact and small (decision 0006). That 800 are enough was measured once, before
this repository, against 500 random ones; no command here repeats it.
"""

# Relative difference within which two distances are equal: above what rounding does, so that a
# rotated or scaled copy of a symmetric shape takes the same vertices and shares the same cells.
# Chosen, not measured.
_TIE = 1e-6
_HEAD = 32  # coordinates that are compared first where many vertices may have a new nearest point,
_MANY = 150  # and how many are many: of 16 to 48 and 100 to 800 hardly one is faster than others
_FADED = 0.1  # where the embedding keeps no more than this of any eigenpair, it fades none; chosen


@dataclass(frozen=True, eq=False)
class SurfaceSample:
    """Vertices that stand for the surface; arrays are read-only.

    Attributes
    ----------
    indices : (s,) int64
        Distinct vertex indices, in the order in which they were taken.
    weights : (s,) float64
        Area of the cell of each: of the vertices nearest to it along the surface. The sum is
        the surface area.
    """

    indices: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "indices", read_only(self.indices, np.int64))
        object.__setattr__(self, "weights", read_only(self.weights, np.float64))


def sample_surface(
    mesh: TriangleMesh, spectrum: Spectrum, *, count: int = SAMPLES
) -> SurfaceSample:
    """Farthest points in the spectral embedding, weighted by cells along the surface.

    Nothing is random, and only intrinsic quantities are used: eigenpairs and edge lengths.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean, of n vertices.
    spectrum : Spectrum
        Of this mesh.
    count : int
        s; all n vertices where there are fewer.

    Returns
    -------
    SurfaceSample
    """
    if count < 1:
        raise InvalidRequestError(f"a sample of {count} points asked for, expected at least 1")
    if len(spectrum.areas) != mesh.n_vertices:
        raise InvalidRequestError(
            f"the spectrum has {len(spectrum.areas)} vertices, the mesh has {mesh.n_vertices}"
        )
    if mesh.n_vertices <= count:
        return SurfaceSample(np.arange(mesh.n_vertices), spectrum.areas)
    # Points are spread in the embedding, which noise and small gaps move least. Their areas are cut
    # along the surface, since a cell in the embedding can reach across a gap.
    graph = length_graph(mesh, undirected_edges(mesh))
    embedding = spectral_embedding(spectrum)  # (n, k)
    seeds = _component_seeds(graph, spectrum.areas, embedding)
    indices = _farthest_points(embedding, seeds[:count], count)
    return SurfaceSample(indices, _cell_areas(graph, spectrum.areas, indices))


def spectral_embedding(spectrum: Spectrum) -> FloatArray:
    """Embedding by φ_i / √λ_i, faded out towards the last eigenvalue.

    Its distances are those of the commute-time kernel, eq. (4) with K² = 1/λ. Near any point they
    are nearly the surface's own, up to a factor (Weyl's law, locally). So farthest points in it lie
    evenly. The factor 1 - (λ_i / λ_k)⁴ makes the last eigenpairs count for nothing. So it does not
    matter which members of a multiple eigenvalue are among the k.

    Parameters
    ----------
    spectrum : Spectrum
        k nonzero eigenpairs at n vertices.

    Returns
    -------
    (n, k) float64
        Free of units.
    """
    values = spectrum.eigenvalues  # (k,)
    fading = 1.0 - (values / values[-1]) ** 4 if len(values) else values
    if np.all(fading < _FADED):  # all eigenvalues (nearly) equal
        fading = np.ones(len(values))
    return spectrum.eigenvectors * (fading / np.sqrt(values))


def _first_largest(values: FloatArray) -> int:
    """Lowest index among those whose value is the largest, up to ties."""
    largest = float(values.max())
    return int(np.argmax(values >= largest - _TIE * abs(largest)))


def _component_seeds(graph: sparse.csr_array, areas: FloatArray, embedding: FloatArray) -> IntArray:
    """The vertex farthest from the embedding's origin in each component, larger ones first."""
    # The first point of a component is the farthest from the origin, as tips are: there is no other
    # point yet to be far from. Larger components come first: a small sample may not reach all.
    n_components, labels = connected_components(graph, directed=False)
    squared = np.einsum("nk,nk->n", embedding, embedding)  # (n,)
    totals = np.bincount(labels, areas, minlength=n_components)
    seeds = []
    for label in np.argsort(-totals, kind="stable"):
        members = np.flatnonzero(labels == label)
        seeds.append(members[_first_largest(squared[members])])
    return np.array(seeds, dtype=np.int64)


def _farthest_points(embedding: FloatArray, seeds: IntArray, count: int) -> IntArray:
    """Extend the seeds to ``count`` vertices, each the farthest from all before it.

    Every vertex keeps its distance to the points taken and the point that is nearest, its cell. A
    new point p is nearer to a vertex at the distance d from its point c only if |p - c| < 2 d, by
    the triangle inequality. Other vertices are not looked at.
    """
    n, k = embedding.shape
    squared = np.einsum("nk,nk->n", embedding, embedding)  # (n,)
    # What rounding can do to a squared distance: of k products in float32, and in float64.
    rough, fine = (
        4.0 * k * np.finfo(t).eps * float(squared.max()) for t in (np.float32, np.float64)
    )
    head = np.ascontiguousarray(embedding[:, :_HEAD])  # (n, h)
    head_squared = np.einsum("nk,nk->n", head, head)
    nearest = np.full(n, np.inf)  # (n,) squared distance to the points taken, -1 for these
    cells = np.zeros(n, dtype=np.int64)
    indices = np.empty(count, dtype=np.int64)
    halves = np.empty((count, k), dtype=np.float32)  # p / 2 of the points taken
    quarters = np.empty(count)  # |p|² / 4
    # Room for what a step computes: new pages for large arrays would take longer than the rest.
    limits, near, also = np.empty(n), np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    room = np.empty((n, k))
    for i in range(count):
        if i < len(seeds):
            taken = int(seeds[i])
        else:  # as `_first_largest` has it; no distance is below 0 but for points taken
            np.greater_equal(nearest, (1.0 - _TIE) * float(nearest.max()), out=near)
            taken = int(near.argmax())
        point, square = embedding[taken], float(squared[taken])
        indices[i], quarters[i], halves[i] = taken, 0.25 * square, 0.5 * point
        # |p - c|² / 4 for the points taken, this one included: vertices beyond it are reached.
        between = quarters[: i + 1] - halves[: i + 1] @ (halves[i] + halves[i])
        between += quarters[i] - rough
        np.take(between, cells, out=limits, mode="clip")
        np.greater(nearest, limits, out=near)
        # Where these are many, the first coordinates alone can tell that p is too far.
        if np.count_nonzero(near) > _MANY:
            shortfall = head @ (-2.0 * head[taken])  # (n,)
            shortfall += head_squared
            shortfall += float(head_squared[taken]) - fine
            near &= np.less(shortfall, nearest, out=also)
        reached = near.nonzero()[0]  # (r,)
        rows = embedding.take(reached, axis=0, out=room[: len(reached)], mode="clip")
        # |x - y|² = |x|² + |y|² - 2 x·y: one product with a vector, not r differences.
        distances = squared[reached] + square - 2.0 * (rows @ point)
        np.maximum(distances, 0.0, out=distances)
        closer = distances < nearest[reached]
        changed = reached[closer]
        nearest[changed] = distances[closer]
        cells[changed] = i
        nearest[taken] = -1.0  # what is taken is not taken again, despite rounding
    return indices


def _cell_areas(graph: sparse.csr_array, areas: FloatArray, indices: IntArray) -> FloatArray:
    """Area of the vertices nearest to each sample along edges, (s,).

    Every vertex hands its area, and what it was handed, down the shortest paths to the samples;
    where several are equally short it divides it among them. So neither rounding nor numbering
    decides on a regular mesh. A component without a sample (there are more of them
    than samples) is shared out by area.
    """
    # How far every vertex is from its nearest sample.
    distances = dijkstra(graph, directed=False, indices=indices, min_only=True)  # (n,)
    # Edges on a shortest path to a sample: where the way down has the length of the edge.
    edges = graph.tocoo()
    upper, lower = edges.row, edges.col  # from the farther to the nearer vertex
    with np.errstate(invalid="ignore"):  # inf - inf, in a component without a sample
        slack = distances[lower] + edges.data - distances[upper]
        downhill = (slack <= _TIE * distances[upper]) & (distances[lower] < distances[upper])
    # With vertices sorted from far to near, "held = own area + shares of those above" is a
    # triangular system: each hands what it holds down its ways, in equal shares.
    upper, lower = upper[downhill], lower[downhill]
    n_ways = np.bincount(upper, minlength=len(areas))
    order = np.argsort(-distances, kind="stable")  # farthest first
    place = np.argsort(order)
    handed = sparse.coo_array(
        (-1.0 / n_ways[upper], (place[lower], place[upper])), shape=graph.shape
    )
    system = sparse.csr_array(handed + sparse.eye_array(len(areas)))  # unit lower triangular
    held = spsolve_triangular(system, areas[order], lower=True, unit_diagonal=True)  # (n,)
    # What has come to the samples; scaled for the components that have none.
    cells = np.asarray(held, dtype=np.float64)[place[indices]]
    return np.asarray(cells * (areas.sum() / cells.sum()), dtype=np.float64)
