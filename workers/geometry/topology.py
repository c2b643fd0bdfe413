"""Components, boundary and Euler characteristic of a mesh, for any winding and manifold or not."""

import numpy as np

from workers.geometry.arrays import IntArray, ascending, first_of_runs
from workers.geometry.edges import component_labels, directed_edges, edge_keys, face_edge_keys
from workers.geometry.mesh import TriangleMesh

LARGEST_NUMBER = 2**63


def vertex_components(mesh: TriangleMesh) -> IntArray:
    """Label the connected components of the vertices.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    (n,) int64
        Label of each vertex, from 0; an unreferenced one is a component.
    """
    edges = directed_edges(mesh.faces)[: 2 * mesh.n_faces]  # two edges connect a face
    return component_labels(edges, mesh.n_vertices)


def face_components(mesh: TriangleMesh) -> IntArray:
    """Label the connected components of the faces; shared vertices connect.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    (m,) int64
        Label of each face, from 0 without gaps.
    """
    labels = vertex_components(mesh)[mesh.faces[:, 0]]  # (m,)
    _, compact = np.unique(labels, return_inverse=True)
    return compact.astype(np.int64).reshape(-1)


def surface_components(mesh: TriangleMesh) -> IntArray:
    """Label the connected components of the faces; shared edges connect.

    Two bodies that touch in a single vertex are two: heat does not flow through a point.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    (m,) int64
        Label of each face, from 0 without gaps, in the order of the components' first faces.
    """
    keys = face_edge_keys(mesh.faces, mesh.n_vertices)  # (3m,)
    m = max(mesh.n_faces, 1)
    if mesh.n_vertices**2 * m < LARGEST_NUMBER:  # an edge and its face as one number
        keys *= m
        keys += np.tile(np.arange(m), 3)[: len(keys)]
        keys.sort()
        ordered, faces = np.divmod(keys, m)  # (3m,)
    else:
        order = np.argsort(keys)
        ordered, faces = keys[order], order % m
    same = np.flatnonzero(ordered[1:] == ordered[:-1])
    return component_labels(np.stack([faces[same], faces[same + 1]], axis=1), mesh.n_faces)


def count_surface_components(mesh: TriangleMesh) -> int:
    """Count the components that `surface_components` labels.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    int
        From 0.
    """
    return int(surface_components(mesh).max(initial=-1)) + 1


def count_components(mesh: TriangleMesh) -> int:
    """Count the components that have faces.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    int
        From 0.
    """
    return len(ascending(vertex_components(mesh)[mesh.faces[:, 0]]))


def boundary_edges(mesh: TriangleMesh) -> IntArray:
    """List the edges that only one face has.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    (b, 2) int64
        In the winding of that face, sorted.
    """
    keys = face_edge_keys(mesh.faces, mesh.n_vertices)
    ordered = np.sort(keys)
    new = first_of_runs(ordered)
    alone = ordered[new & np.append(new[1:], True)]  # (b,)
    if len(alone) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    near = np.zeros(mesh.n_vertices, dtype=np.bool_)
    for ends in np.divmod(alone, mesh.n_vertices):
        near[ends] = True
    edges = directed_edges(mesh.faces[near[mesh.faces].sum(axis=1) >= 2])
    keys = edge_keys(edges, mesh.n_vertices)
    place = np.minimum(np.searchsorted(alone, keys), len(alone) - 1)
    single = np.empty((len(alone), 2), dtype=np.int64)
    found = alone[place] == keys
    single[place[found]] = edges[found]
    return single


def euler_characteristic(mesh: TriangleMesh) -> int:
    """Vertices - edges + faces, without unreferenced vertices.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    int
        2 for a sphere, 0 for a torus.
    """
    keys = np.sort(face_edge_keys(mesh.faces, mesh.n_vertices))
    n_edges = int(first_of_runs(keys).sum()) if len(keys) else 0
    return count_referenced(mesh) - n_edges + mesh.n_faces


def count_referenced(mesh: TriangleMesh) -> int:
    """Count the vertices that have a face.

    Parameters
    ----------
    mesh : TriangleMesh
        With indices in range.

    Returns
    -------
    int
        At most n.
    """
    referenced = np.zeros(mesh.n_vertices, dtype=np.bool_)
    referenced[mesh.faces] = True
    return int(referenced.sum())


def boundary_loops(mesh: TriangleMesh) -> list[IntArray]:
    """Find simple cycles of boundary edges.

    Where several loops touch in a vertex they are separated; where faces are wound against
    each other the loop goes on all the same; boundary that does not come back (at edges of
    three faces) is left out. Each edge is in one loop at most.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    list of (l,) int64
        Vertex indices of each loop, in the winding of its faces.
    """
    edges = boundary_edges(mesh)
    order = np.argsort(edges[:, 0], kind="stable")
    outgoing: dict[int, list[int]] = {}
    incoming: dict[int, list[int]] = {}
    pairs = edges[order].tolist()
    for number, (start, end) in enumerate(pairs):
        outgoing.setdefault(start, []).append(number)
        incoming.setdefault(end, []).append(number)
    walk = _BoundaryWalk(pairs, outgoing, incoming)
    loops: list[IntArray] = []
    for start, _ in pairs:
        loops += walk.loops_from(start)
    return loops


class _BoundaryWalk:
    """Walks along unused boundary edges and cuts off a loop whenever it meets its own path."""

    def __init__(
        self,
        pairs: list[list[int]],
        outgoing: dict[int, list[int]],
        incoming: dict[int, list[int]],
    ) -> None:
        self._pairs = pairs
        self._outgoing = outgoing
        self._incoming = incoming
        self._used = bytearray(len(pairs))

    def loops_from(self, start: int) -> list[IntArray]:
        """Loops that a walk from this vertex closes, until it has no edge left to go."""
        loops = []
        path = [start]
        place = {start: 0}
        while path:
            step = self._step(path[-1])
            if step is None:
                del place[path.pop()]
            elif step in place:
                cut = place[step]
                if len(path) - cut >= 3:
                    loops.append(np.array(path[cut:], dtype=np.int64))
                for vertex in path[cut + 1 :]:
                    del place[vertex]
                del path[cut + 1 :]
            else:
                place[step] = len(path)
                path.append(step)
        return loops

    def _step(self, vertex: int) -> int | None:
        """Other end of an unused edge, with the winding if possible, or None."""
        for edges, end in ((self._outgoing, 1), (self._incoming, 0)):
            numbers = edges.get(vertex, [])
            while numbers:
                number = numbers.pop()
                if not self._used[number]:
                    self._used[number] = 1
                    return self._pairs[number][end]
        return None
