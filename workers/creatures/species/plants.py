"""Plants that sway."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z, beside
from workers.creatures.skeleton import Skeleton
from workers.geometry.arrays import FloatArray


def tree(rng: np.random.Generator) -> Skeleton:
    """A trunk with roots, and boughs that carry clumps of leaves.

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
    tall = body.vary(0.78, 0.12)
    trunk = [(0, 0, 0), (0.02, 0.5 * tall, 0), (0, tall, 0.01), (0.01, 1.4 * tall, 0)]
    body.limb("trunk", "root", trunk, (0.115, 0.085, 0.08, 0.06), softness=0.25)
    for number in range(5):
        turn = np.radians(72 * number + 20)
        foot = (0.2 * float(np.cos(turn)), 0.0, 0.2 * float(np.sin(turn)))
        body.limb(f"foot{number}", "root", [(0, 0.06, 0), foot], (0.08, 0.04), rigid=True)
    _clump(body, "trunk.2", np.array([0.01, 1.4 * tall + 0.22, 0]), body.vary(0.3, 0.12))
    for number in range(4):
        turn = np.radians(90 * number + body.vary(35, 0.3))
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        start = np.array([0.0, tall * (0.78 + 0.09 * (number % 2)), 0.0])
        end = beside(start + body.vary(0.5, 0.08) * out, 0, body.vary(0.16, 0.4), 0)
        bough = f"bough{number}"
        bend = beside((start + end) / 2, 0, -0.04, 0)
        body.limb(bough, "trunk.1", [start, bend, end], (0.06, 0.05, 0.045))
        _clump(body, f"{bough}.1", end + 0.06 * out, body.vary(0.22, 0.12))
        body.curl(bough, Y, -16, 16)
        body.curl(bough, np.cross(out, np.array(Y)), -25, 20)
    body.curl("trunk", X, -22, 22)
    body.curl("trunk", Z, -22, 22)
    return body.skeleton()


def _clump(body: SkeletonBuilder, bone: str, centre: FloatArray, size: float) -> None:
    """Leaves: some blobs that bulge out of a larger one."""
    body.blob(bone, centre, (size, 0.82 * size, size), softness=0.1)
    for angle in (10, 82, 154, 226, 298):
        turn = np.radians(angle)
        place = centre + 0.6 * size * np.array([np.cos(turn), -0.25, np.sin(turn)])
        body.blob(bone, place, (0.52 * size,) * 3, softness=0.1, jitter=0.12)
    body.blob(bone, beside(centre, 0, 0.55 * size, 0), (0.6 * size,) * 3, softness=0.1)


def cactus(rng: np.random.Generator) -> Skeleton:
    """A column with arms that turn upwards.

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
    tall, thick = body.vary(1.3, 0.1), body.vary(0.15, 0.1)
    points = [(0, tall * i / 6, 0) for i in range(7)]
    body.limb(
        "column",
        "root",
        points,
        [thick * share for share in (0.9, 1, 1.05, 1.05, 1.05, 1, 0.9)],
        softness=0.2,
    )
    arms = (("first", 1.0, 0.36, 0.55), ("second", -1.0, 0.52, 0.4))
    for name, side, share, rise in arms:
        low, reach = tall * body.vary(share, 0.12), side * body.vary(0.4, 0.1)
        up = body.vary(rise, 0.15)
        arm = [
            (0, low, 0),
            (0, low, 0.6 * reach),
            (0, low + 0.07, reach),
            (0, low + 0.5 * up, 1.08 * reach),
            (0, low + up, 1.08 * reach),
        ]
        body.limb(
            name,
            "column.2" if share < 0.5 else "column.3",
            arm,
            [thick * k for k in (0.6, 0.62, 0.66, 0.68, 0.6)],
            softness=0.2,
        )
        body.curl(name, X, -35, 35)
        body.curl(name, Y, -35, 35)
    third = [
        (0.0, 0.66 * tall, 0.0),
        (0.2, 0.67 * tall, 0.06),
        (0.29, 0.75 * tall, 0.08),
        (0.3, 0.92 * tall, 0.08),
    ]
    body.limb(
        "third", "column.4", third, [thick * k for k in (0.5, 0.52, 0.54, 0.48)], softness=0.2
    )
    body.curl("column", X, -28, 28)
    body.curl("column", Z, -28, 28)
    return body.skeleton(heading=85)


SPECIES = {
    "tree": tree,
    "cactus": cactus,
}
