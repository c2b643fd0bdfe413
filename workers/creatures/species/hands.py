"""A hand."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Z
from workers.creatures.skeleton import Skeleton


def hand(rng: np.random.Generator) -> Skeleton:
    """A right hand with the fingers spread, and its wrist.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.0, 0.0))
    length, thick = body.vary(1.0, 0.1), body.vary(1.0, 0.1)
    body.limb(
        "wrist",
        "root",
        [(0, 0.05, 0), (0, -0.2, 0), (0, -0.42, 0)],
        (0.17, 0.15, 0.155),
        flat=X,
        ratio=0.78,
    )
    body.blob("root", (0, 0.24, 0), (0.115, 0.3, 0.27), power=3)
    fingers = (
        ("index", 0.22, 0.5, 0.34, 13),
        ("middle", 0.075, 0.53, 0.38, 4),
        ("ring", -0.075, 0.52, 0.355, -5),
        ("little", -0.21, 0.45, 0.28, -15),
    )
    for name, across, base, reach, spread in fingers:
        turn = np.radians(spread)
        out = np.array([0.02, np.cos(turn), np.sin(turn)])
        start = np.array([0.0, base, across])
        reach = body.vary(reach, 0.05) * length
        points = [start - 0.22 * out, start] + [
            start + reach * share * out for share in (0.48, 0.78, 1.02)
        ]
        radii = [thick * radius for radius in (0.085, 0.075, 0.066, 0.06, 0.05)]
        body.limb(name, "root", points, radii, softness=0.15)
        bones = [f"{name}.{i}" for i in (1, 2, 3)]
        body.move(bones, Z, -85, 6, shares=(0.8, 1.0, 0.6))
        body.move(f"{name}.1", X, -5, 5)
    thumb = [(0.04, 0.1, 0.18), (0.1, 0.26, 0.35), (0.11, 0.42, 0.47), (0.11, 0.55, 0.54)]
    body.limb(
        "thumb",
        "root",
        thumb,
        [thick * radius for radius in (0.105, 0.085, 0.072, 0.056)],
        softness=0.2,
    )
    body.move(["thumb.0", "thumb.1", "thumb.2"], (0.1, 0.6, 0.5), -40, 15, shares=(0.5, 0.6, 0.5))
    body.curl("wrist", Z, -25, 25)
    body.curl("wrist", X, -15, 15)
    return body.skeleton(heading=72)


SPECIES = {
    "hand": hand,
}
