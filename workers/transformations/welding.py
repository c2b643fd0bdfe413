"""Topology: parts that touch, or nearly, are welded to each other."""

import numpy as np
from scipy.spatial.distance import cdist

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.edges import directed_edges, length_graph, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_edges
from workers.transformations.metric import geodesic_distances
from workers.transformations.transformed import TransformedMesh, part

# Chosen, not measured.
_SAMPLE = 1_500  # faces between which contacts are looked for
_LANDMARKS = 60  # vertices from which distances along the surface are known
_HORIZON = 1.5  # √A: farther along the surface is as good as infinite
_FAR = 0.35  # √A: at least so long is the way along the surface between two parts,
_DETOURS = (2.0, 1.2)  # and so many times the gap; the second where the first holds for fewer
_ENOUGH = 50  # faces than that
_THROUGH = 4.0  # factor on a gap that is bridged through the inside of the body
_JITTER = 0.4  # standard deviation of the logarithm by which chance changes a gap


def weld(
    mesh: TriangleMesh, *, fewest: int, most: int, gap: float, rng: np.random.Generator
) -> TransformedMesh:
    """Weld faces that lie near in space and far along the surface.

    Two such faces are taken out and their corners made one, pair by pair, in the middle: a handle.
    Faces are chosen so that the surface stays a manifold where it was one. Where too little is near
    enough, the narrowest gaps there are get welded.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    fewest, most : int
        Number of welds; fewer than that only where there is no room for them.
    gap : float
        Widest gap that is welded before there are the fewest, in √A.
    rng : Generator
        Decides which of the gaps are welded.

    Returns
    -------
    TransformedMesh
        Without the faces that were taken out.
    """
    pairs, gaps = _contacts(mesh, rng)  # (c, 2), (c,)
    tried = np.argsort(gaps * np.exp(_JITTER * rng.normal(size=len(gaps))), kind="stable")
    near = tried[gaps[tried] <= gap * np.sqrt(mesh.area)]
    untouched = _Untouched(mesh)
    chosen = [pair for pair in pairs[near] if untouched.has_fewer(most) and untouched.take(pair)]
    narrow = np.argsort(gaps, kind="stable")
    chosen += [
        pair for pair in pairs[narrow] if untouched.has_fewer(fewest) and untouched.take(pair)
    ]
    return _welded(mesh, chosen)


def _contacts(mesh: TriangleMesh, rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
    """Pairs of faces (c, 2) far from each other along the surface, and their gaps (c,).

    For each of 1,500 faces the one of them that has the narrowest gap to it.
    """
    unit = float(np.sqrt(mesh.area))
    faces = np.sort(rng.choice(mesh.n_faces, size=min(_SAMPLE, mesh.n_faces), replace=False))
    middles = mesh.vertices[mesh.faces[faces]].mean(axis=1)  # (s, 3)
    gaps = cdist(middles, middles)  # (s, s)
    ways = _ways_along(mesh, mesh.faces[faces, 0], _HORIZON * unit, rng)
    for detour in _DETOURS:
        longest = np.minimum(detour * gaps, _HORIZON * unit)
        far = ways >= np.maximum(_FAR * unit, longest)  # (s, s)
        if np.count_nonzero(far.any(axis=1)) >= _ENOUGH:
            break
    gaps[~far] = np.inf
    normals = mesh.face_normals[faces]
    ahead = normals @ middles.T - np.einsum("si,si->s", normals, middles)[:, None]
    gaps[(ahead < 0.0) | (ahead.T < 0.0)] *= _THROUGH
    nearest = np.argmin(gaps, axis=1)  # (s,)
    narrow = gaps[np.arange(len(faces)), nearest]
    found = np.isfinite(narrow)
    return np.stack([faces, faces[nearest]], axis=1)[found], narrow[found]


def _ways_along(
    mesh: TriangleMesh, vertices: IntArray, horizon: float, rng: np.random.Generator
) -> FloatArray:
    """Least lengths (s, s) that the ways along the surface can have between some vertices.

    By the triangle inequality, over the landmark nearest to each; inf beyond the horizon.
    """
    landmarks = rng.choice(vertices, size=min(_LANDMARKS, len(vertices)), replace=False)
    graph = length_graph(mesh, undirected_edges(mesh))
    distances = geodesic_distances(graph, landmarks, limit=horizon)[:, vertices]  # (l, s)
    nearest = np.argmin(distances, axis=0)  # (s,)
    own = distances[nearest, np.arange(len(vertices))]
    own = np.where(np.isfinite(own), own, 0.0)  # in a component without a landmark
    least = distances[nearest] - own[:, None]
    return np.asarray(np.minimum(least, least.T), dtype=np.float64)


class _Untouched:
    """Vertices that no weld has touched yet; those of the boundary are not for welding."""

    def __init__(self, mesh: TriangleMesh) -> None:
        """Sort the neighbours of each vertex."""
        halves = directed_edges(mesh.faces)
        ends = np.concatenate([halves, halves[:, ::-1]])
        ends = ends[np.argsort(ends[:, 0], kind="stable")]
        self._faces = mesh.faces
        self._neighbours = ends[:, 1]
        self._starts = np.searchsorted(ends[:, 0], np.arange(mesh.n_vertices + 1))
        self._taken: BoolArray = np.zeros(mesh.n_vertices, dtype=np.bool_)
        self._taken[boundary_edges(mesh)] = True
        self._welds = 0

    def has_fewer(self, welds: int) -> bool:
        """Whether there are fewer than so many welds yet."""
        return self._welds < welds

    def take(self, pair: IntArray) -> bool:
        """Take two faces and all vertices around them; False if any is taken or common."""
        both = np.concatenate([self._around(face) for face in self._faces[pair]])
        if self._taken[both].any() or len(np.unique(both)) < len(both):
            return False
        self._taken[both] = True
        self._welds += 1
        return True

    def _around(self, face: IntArray) -> IntArray:
        """Corners of a face and their neighbours, each once."""
        stars = [self._neighbours[self._starts[v] : self._starts[v + 1]] for v in face]
        return np.unique(np.concatenate(stars))


def _welded(mesh: TriangleMesh, pairs: list[IntArray]) -> TransformedMesh:
    """The mesh with the corners of the faces of each pair made one, and the faces gone."""
    vertices = mesh.vertices.copy()
    owner = np.arange(mesh.n_vertices)
    kept: BoolArray = np.ones(mesh.n_faces, dtype=np.bool_)
    for first, second in pairs:
        corners, others = _opposite(mesh, int(first), int(second))
        vertices[corners] = 0.5 * (mesh.vertices[corners] + mesh.vertices[others])
        owner[others] = corners
        kept[[first, second]] = False
    return part(TriangleMesh(vertices, owner[mesh.faces]), kept)


def _opposite(mesh: TriangleMesh, first: int, second: int) -> tuple[IntArray, IntArray]:
    """Corners (3,) of a face, and those of another, against its winding, nearest to them."""
    corners, backwards = mesh.faces[first], mesh.faces[second, ::-1]
    turns = [np.roll(backwards, turn) for turn in range(3)]
    lengths = [
        np.linalg.norm(mesh.vertices[corners] - mesh.vertices[others], axis=1).sum()
        for others in turns
    ]
    return corners, turns[int(np.argmin(lengths))]
