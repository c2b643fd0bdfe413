"""Furniture, as if of rubber."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton


def _legs(body: SkeletonBuilder, *, x: float, z: float, top: float, radius: float) -> None:
    """Four legs under a board, each of two bones."""
    foot = top - body.vary(top - radius, 0.12)
    for name, sign in (("foreleg", 1.0), ("hindleg", -1.0)):
        points = [
            (sign * x, top, z),
            (sign * 1.04 * x, (top + foot) / 2, 1.04 * z),
            (sign * 1.08 * x, foot, 1.08 * z),
        ]
        body.limb(
            name, "root", points, (1.1 * radius, radius, 0.9 * radius), mirrored=True, softness=0.15
        )
        body.move(f"{name}.0", Z, -14, 14)
        body.move(f"{name}.0", X, -14, 14)
        body.move(f"{name}.1", Z, -22, 22)
        body.move(f"{name}.1", X, -22, 22)


def chair(rng: np.random.Generator) -> Skeleton:
    """A seat on four legs, and a back.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.46, 0.0))
    deep, wide = body.vary(0.25, 0.1), body.vary(0.25, 0.12)
    high = body.vary(0.5, 0.14)
    body.blob("root", (0, 0.48, 0), (deep, 0.042, wide), power=8, softness=0.1, jitter=0)
    _legs(body, x=deep - 0.05, z=wide - 0.05, top=0.46, radius=0.036)
    rear = -deep + 0.04
    middle = 0.48 + 0.5 * high
    body.joint("low", "root", (rear, 0.48, 0), (rear, middle, 0))
    body.joint("high", "low.0", (rear, middle, 0), (rear, 0.48 + high, 0))
    for bone, height, joined in (
        ("low.0", middle - 0.25 * high, False),
        ("high.0", middle + 0.25 * high, True),
    ):
        half = (0.04, 0.33 * high, wide)
        body.blob(bone, (rear, height, 0), half, power=8, joined=joined, softness=0.1, jitter=0)
    body.move(["low.0", "high.0"], Z, -18, 35, shares=(0.6, 0.6))
    body.move(["low.0", "high.0"], Y, -18, 18, shares=(0.5, 0.5))
    return body.skeleton(heading=20)


def table(rng: np.random.Generator) -> Skeleton:
    """A board on four legs.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.66, 0.0))
    long, wide = body.vary(0.62, 0.15), body.vary(0.38, 0.15)
    body.blob("root", (0, 0.7, 0), (long, 0.045, wide), power=8, softness=0.1)
    _legs(body, x=long - 0.08, z=wide - 0.08, top=0.68, radius=0.046)
    return body.skeleton(heading=20)


SPECIES = {
    "chair": chair,
    "table": table,
}
