"""Components, boundary and Euler characteristic of a mesh, for any winding and manifold or not."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import BoolArray, IntArray, ascending, first_of_runs
from workers.geometry.edges import (
    component_labels,
    directed_edges,
    edge_keys,
    face_edge_keys,
    single_edges,
)
from workers.geometry.mesh import TriangleMesh

LARGEST_NUMBER = 2**64


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
    return _connection(mesh).labels


@dataclass(frozen=True, eq=False)
class _Connection:
    """How the faces of a mesh hang together.

    Attributes
    ----------
    labels : (m,) int64
        Component of each face; read-only.
    n_edges, n_single : int
        Edges, and those of them that only one face has.
    """

    labels: IntArray
    n_edges: int
    n_single: int


_KNOWN: WeakKeyDictionary[TriangleMesh, _Connection] = WeakKeyDictionary()  # of living meshes


def _connection(mesh: TriangleMesh) -> _Connection:
    """Find how the faces hang together, once for each mesh: several steps ask for it."""
    known = _KNOWN.get(mesh)
    if known is not None:
        return known
    ordered, faces = _edges_of_faces(mesh)  # (3m,)
    new = first_of_runs(ordered)
    n_single = int((new & np.append(new[1:], True)[: len(new)]).sum())
    labels = _joined(ordered, faces, new, mesh.n_faces)
    if labels.max(initial=0) == 0:  # the same number everywhere needs no room
        labels = np.broadcast_to(np.int64(0), labels.shape)
    labels.flags.writeable = False
    found = _KNOWN[mesh] = _Connection(labels, int(new.sum()), n_single)
    return found


def pass_on(mesh: TriangleMesh, copy: TriangleMesh) -> None:
    """Let a mesh know what is known of the components, edges and boundary of another one.

    Parameters
    ----------
    mesh : TriangleMesh
        Perhaps its components were labelled.
    copy : TriangleMesh
        With the same faces in the same order, whatever their vertices are called.
    """
    known = _KNOWN.get(mesh)
    if known is not None:
        _KNOWN[copy] = known


def _edges_of_faces(mesh: TriangleMesh) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Edges of all faces (3m,) as numbers that ascend, and the face (3m,) of each."""
    keys = face_edge_keys(mesh.faces, mesh.n_vertices)  # (3m,)
    bits = max(mesh.n_faces - 1, 1).bit_length()
    if mesh.n_vertices**2 << bits > LARGEST_NUMBER:
        order = np.argsort(keys, kind="stable")
        return keys[order], order % max(mesh.n_faces, 1)
    # An edge and its face as one number: sorting numbers takes a tenth of sorting places.
    packed = keys.view(np.uint64)
    packed <<= np.uint64(bits)
    packed.reshape(3, -1)[:] |= np.arange(mesh.n_faces, dtype=np.uint64)
    packed.sort()
    faces = packed & np.uint64((1 << bits) - 1)
    packed >>= np.uint64(bits)
    return packed, faces.view(np.int64)


def _joined(
    ordered: NDArray[np.integer], faces: NDArray[np.integer], new: BoolArray, n_faces: int
) -> IntArray:
    """Components of faces that share edges, from what `_edges_of_faces` gives."""
    same = np.flatnonzero(~new[1:])
    pairs = np.stack([faces.take(same), faces.take(same + 1)])  # (2, p)
    return component_labels(pairs.T, n_faces)


def is_closed(mesh: TriangleMesh) -> bool:
    """Tell whether no edge has only one face.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any winding, manifold or not.

    Returns
    -------
    bool
        True without any face.
    """
    return _connection(mesh).n_single == 0


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
    known = _KNOWN.get(mesh)
    if known is not None and known.n_single == 0:
        return np.zeros((0, 2), dtype=np.int64)
    corners, faces = single_edges(mesh.faces, mesh.n_vertices)
    edges = np.stack([mesh.faces[faces, corners], mesh.faces[faces, (corners + 1) % 3]], axis=1)
    sorted_edges: IntArray = edges[np.argsort(edge_keys(edges, mesh.n_vertices))]
    return sorted_edges


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
    return count_referenced(mesh) - _connection(mesh).n_edges + mesh.n_faces


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
