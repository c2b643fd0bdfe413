"""Edges between two faces each, found by sorting."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import BoolArray, IntArray
from workers.geometry.edges import edge_keys, face_edge_keys


@dataclass(frozen=True, eq=False)
class SharedEdges:
    """Edges between two faces each, (a, b, c) and (b, a, d): no others, and one winding.

    Attributes
    ----------
    ends : (e, 2) int64
        a and b.
    tips : (e, 2) int64
        c and d.
    faces : (e, 2) int64
        Numbers of both faces.
    keys : (3m,) int64
        `edge_keys` of all edges of all faces, ascending.
    """

    ends: IntArray
    tips: IntArray
    faces: IntArray
    keys: IntArray

    @classmethod
    def of(cls, faces: IntArray, n_vertices: int) -> "SharedEdges":
        """Find them.

        Parameters
        ----------
        faces : (m, 3) int64
            Vertex indices of each face.
        n_vertices : int
            n, above every index.

        Returns
        -------
        SharedEdges
            In ascending order of their keys.
        """
        corners = faces.T
        starts = corners.ravel()
        ends = corners[[1, 2, 0]].ravel()
        tips = corners[[2, 0, 1]].ravel()
        keys = face_edge_keys(faces, n_vertices)
        order = np.argsort(keys, kind="stable")
        keys = keys[order]
        same = keys[1:] == keys[:-1]
        twice = same.copy()  # the first of exactly two
        twice[1:] &= ~same[:-1]
        twice[:-1] &= ~same[1:]
        first = np.flatnonzero(twice)
        one, two = order[first], order[first + 1]
        opposed = starts[one] == ends[two]
        one, two = one[opposed], two[opposed]
        return cls(
            np.stack([starts[one], ends[one]], axis=1),
            np.stack([tips[one], tips[two]], axis=1),
            np.stack([one, two], axis=1) % len(faces),
            keys,
        )

    def contain(self, pairs: IntArray, n_vertices: int) -> BoolArray:
        """Tell which pairs of vertices are an edge of a face, shared or not.

        Parameters
        ----------
        pairs : (e, 2) int64
            Vertex indices.
        n_vertices : int
            As in `of`.

        Returns
        -------
        (e,) bool
        """
        wanted = edge_keys(pairs, n_vertices)
        at = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        found: BoolArray = self.keys[at] == wanted
        return found
