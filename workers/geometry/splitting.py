"""Faces are split at vertices on their edges."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.degenerate import degenerate_faces
from workers.geometry.edges import directed_edges, edge_keys
from workers.geometry.openings import OpenEdges

Splits = dict[int, list[int]]  # vertices on an open edge, in their order along it


@dataclass(frozen=True, eq=False)
class SplitFaces:
    """Faces after some were split.

    Attributes
    ----------
    faces : (m + s, 3) int64
        With the pieces of each face in its place.
    harmful : (h,) int64
        Numbers of the faces, before, whose pieces have no area, repeat other faces, or make an
        edge that more than two faces share.
    """

    faces: IntArray
    harmful: IntArray


def split_faces(
    vertices: FloatArray, faces: IntArray, opening: OpenEdges, splits: Splits
) -> SplitFaces:
    """Split faces at vertices on their open edges.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    faces : (m, 3) int64
        Without degenerate or repeated ones.
    opening : OpenEdges
        Of these faces.
    splits : dict
        By open edge, the vertices at which it is split; at least one.

    Returns
    -------
    SplitFaces
        All faces, and which splits do harm.
    """
    chains = _by_face(faces, opening, splits)
    split = np.array(sorted(chains))
    cut = [_cut_face(vertices, faces[face].tolist(), chains[face]) for face in split.tolist()]
    pieces = np.array([piece for of_face in cut for piece in of_face], dtype=np.int64)
    counts = np.ones(len(faces), dtype=np.int64)
    counts[split] = [len(of_face) for of_face in cut]
    result = np.repeat(faces, counts, axis=0)
    is_piece = np.repeat(counts > 1, counts)
    result[is_piece] = pieces
    bad = degenerate_faces(vertices, pieces) | _crowded(result, is_piece, len(vertices))
    return SplitFaces(result, np.unique(np.repeat(split, counts[split])[bad]))


def _crowded(faces: IntArray, chosen: BoolArray, n_vertices: int) -> BoolArray:
    """Which of the chosen faces repeat another face or have an edge of more than two faces."""
    near = np.zeros(n_vertices, dtype=np.bool_)
    near[faces[chosen]] = True
    around = near[faces].sum(axis=1) >= 2  # they have an edge that could be one of theirs
    of_chosen = chosen[around]
    keys = edge_keys(directed_edges(faces[around]), n_vertices)
    _, edge, n_faces = np.unique(keys, return_inverse=True, return_counts=True)
    crowded = (n_faces > 2)[edge].reshape(3, -1).any(axis=0)
    corners = np.sort(faces[around], axis=1)
    _, kind, alike = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    bad: BoolArray = (crowded | (alike > 1)[kind.reshape(-1)])[of_chosen]
    return bad


def _by_face(faces: IntArray, opening: OpenEdges, splits: Splits) -> dict[int, list[list[int]]]:
    """Vertices on the three edges of each face that is split, in its winding."""
    chains: dict[int, list[list[int]]] = {}
    for edge, on_edge in splits.items():
        face = int(opening.faces[edge])
        corner = faces[face].tolist().index(int(opening.ends[edge, 0]))
        chains.setdefault(face, [[], [], []])[corner] = on_edge
    return chains


def _cut_face(vertices: FloatArray, corners: list[int], chains: list[list[int]]) -> list[list[int]]:
    """Triangles of a face with vertices on its edges: fans, over the longest edge first."""
    waiting = [(corners, chains)]
    done = []
    while waiting:
        (a, b, c), on_edges = waiting.pop()
        if not any(on_edges):
            done.append([a, b, c])
            continue
        ends = vertices[[[a, b], [b, c], [c, a]]]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        opposite = vertices[[c, a, b]].tolist()  # decides where edges are of one length
        turn = max(range(3), key=lambda i: (bool(on_edges[i]), lengths[i], opposite[i]))
        a, b, c = ([a, b, c] * 2)[turn : turn + 3]
        base, after, before = (on_edges * 2)[turn : turn + 3]
        path = [a, *base, b]
        for i, (start, end) in enumerate(pairwise(path)):
            right = after if i == len(path) - 2 else []
            left = before if i == 0 else []
            waiting.append(([start, end, c], [[], right, left]))
    return done
