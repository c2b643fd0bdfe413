"""Whether limbs that are apart stay apart in a pose."""

import numpy as np

from workers.creatures.skeleton import Skeleton
from workers.creatures.skinning import blend
from workers.geometry.arrays import BoolArray, FloatArray

# Chosen, not measured.
_LEAST = 0.35  # share of the gap at rest that must stay, or of the radii where that is smaller


class Clearance:
    """Spheres along all capsules, and the gaps between those that are apart at rest."""

    def __init__(self, skeleton: Skeleton) -> None:
        centres, radii, bones = [], [], []
        for capsule in skeleton.capsules:
            width = capsule.thinness * max(capsule.radii)
            count = (
                int(np.clip(np.linalg.norm(capsule.end - capsule.start) / (2 * width), 1, 4)) + 1
            )
            for share in np.linspace(0.0, 1.0, count):
                centres.append(capsule.start + share * (capsule.end - capsule.start))
                radius = capsule.radii[0] + share * (capsule.radii[1] - capsule.radii[0])
                radii.append(radius * capsule.thinness)
                bones.append(capsule.bone)
        self._centres = np.array(centres)  # (s, 3)
        self._bones = np.array(bones)  # (s,)
        self._ancestry = skeleton.ancestry
        size = np.array(radii)
        touch = size[:, None] + size[None, :]  # (s, s)
        gap = self._distances(self._centres) - touch
        needed = touch + _LEAST * np.minimum(gap, 0.5 * touch)
        self._needed = np.where(gap > 0.5 * touch, needed, 0.0)

    def offenders(self, motions: FloatArray) -> BoolArray:
        """Bones that bring together what was apart.

        They carry one of two spheres that come too close, but not the other.

        Parameters
        ----------
        motions : (b, 8) float64
            Rigid motion of each bone, as a unit dual quaternion.

        Returns
        -------
        (b,) bool
        """
        moved = blend(self._centres, np.eye(len(motions))[self._bones], motions)
        first, second = np.nonzero(np.triu(self._distances(moved) < self._needed))
        carried = self._ancestry[self._bones[first]] ^ self._ancestry[self._bones[second]]
        guilty: BoolArray = carried.any(axis=0)
        return guilty

    @staticmethod
    def _distances(centres: FloatArray) -> FloatArray:
        squares = (centres**2).sum(axis=1)
        squared = (
            squares[:, None] + squares[None, :] - 2.0 * np.einsum("ic,jc->ij", centres, centres)
        )
        distances: FloatArray = np.sqrt(np.maximum(squared, 0.0))
        return distances
