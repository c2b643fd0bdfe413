"""Creatures on six legs, and the legs of all that have many."""

from collections.abc import Sequence

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton


def many_legs(
    body: SkeletonBuilder,
    places: Sequence[tuple[float, float]],
    *,
    parent: str,
    start: tuple[float, float],
    reach: float,
    rise: float,
    radius: float,
    ground: float = 0.03,
) -> None:
    """Pairs of legs that rise to a knee and come down to the ground.

    Parameters
    ----------
    body : SkeletonBuilder
        To which they are added.
    places : sequence of (x, angle)
        Where each pair leaves the body, and its heading in degrees forwards of sideways.
    parent : str
        The bone that carries them.
    start : (height, half width)
        Where they leave the body, above the ground and beside its middle.
    reach : float
        Horizontal length of a leg.
    rise : float
        Height of the knee above the start.
    radius : float
        Of the leg's flesh.
    ground : float
        Height of the feet.
    """
    height, wide = start
    reach = body.vary(reach, 0.1)
    for number, (x, angle) in enumerate(places):
        out = np.array([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
        hip = np.array([x, height, wide])
        knee = hip + 0.42 * reach * out + np.array([0.0, rise, 0.0])
        shin = hip + 0.8 * reach * out
        shin[1] = 0.42 * knee[1] + 0.58 * ground
        foot = hip + reach * out
        foot[1] = ground
        name = f"leg{number}"
        body.limb(
            name,
            parent,
            [hip, knee, shin, foot],
            (1.25 * radius, 1.1 * radius, radius, 0.9 * radius),
            mirrored=True,
            softness=0.2,
        )
        body.move(f"{name}.0", Y, -20, 20)
        body.move(f"{name}.0", X, -14, 12)
        body.move(f"{name}.1", (float(out[2]), 0.0, float(-out[0])), -16, 22)


def ant(rng: np.random.Generator) -> Skeleton:
    """Head, thorax and abdomen like beads, six legs, elbowed feelers.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.3, 0.0))
    body.limb(
        "spine",
        "root",
        [(0.16, 0.3, 0), (-0.02, 0.32, 0), (-0.2, 0.29, 0)],
        (0.085, 0.09, 0.05),
        softness=0.15,
    )
    gaster = body.vary(0.25, 0.12)
    body.limb("waist", "spine.1", [(-0.18, 0.29, 0), (-0.3, 0.32, 0)], (0.045, 0.05), softness=0.15)
    body.blob("waist.0", (-0.32 - gaster, 0.34, 0), (gaster, 0.165, 0.165), pitch=-6, softness=0.15)
    head = body.vary(0.13, 0.1)
    body.limb("neck", "root", [(0.16, 0.3, 0), (0.3, 0.32, 0)], (0.05, 0.05), softness=0.15)
    body.blob(
        "neck.0",
        (0.3 + head, 0.33, 0),
        (1.25 * head, 0.95 * head, 1.15 * head),
        pitch=-15,
        softness=0.15,
    )
    front = 0.3 + 2.1 * head
    body.limb(
        "jaw",
        "neck.0",
        [(front - 0.04, 0.26, 0.075), (front + 0.1, 0.22, 0.07)],
        (0.035, 0.027),
        mirrored=True,
        softness=0.15,
    )
    body.limb(
        "feeler",
        "neck.0",
        [(front - 0.06, 0.4, 0.06), (front + 0.08, 0.56, 0.16), (front + 0.26, 0.46, 0.22)],
        (0.027, 0.026, 0.026),
        mirrored=True,
        softness=0.15,
    )
    many_legs(
        body,
        ((0.12, 38), (0.0, 2), (-0.12, -36)),
        parent="root",
        start=(0.28, 0.06),
        reach=0.58,
        rise=0.2,
        radius=0.03,
    )
    body.move("waist.0", Z, -25, 20)
    body.move("waist.0", Y, -25, 25)
    body.move("neck.0", Y, -30, 30)
    body.move("neck.0", Z, -20, 20)
    body.move("feeler.0", Y, -25, 20)
    body.move("feeler.1", Y, -30, 30)
    return body.skeleton(heading=14)


def beetle(rng: np.random.Generator) -> Skeleton:
    """A dome of wing cases, a shield, a head with a great horn, six legs.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.25, 0.0))
    long, wide = body.vary(0.42, 0.1), body.vary(0.31, 0.1)
    body.blob("root", (-0.12, 0.26, 0), (long, 0.225, wide), softness=0.12)
    body.limb("chest", "root", [(0.16, 0.25, 0), (0.36, 0.24, 0)], (0.16, 0.15), softness=0.1)
    body.blob("chest.0", (0.34, 0.25, 0), (0.15, 0.17, 0.23), softness=0.1)
    body.limb("head", "chest.0", [(0.45, 0.2, 0), (0.56, 0.18, 0)], (0.11, 0.1), softness=0.12)
    horn = [(0.6, 0.2, 0), (0.78, 0.26, 0), (0.86, 0.42, 0), (0.8, 0.56, 0)]
    body.limb("horn", "head.0", horn, (0.06, 0.048, 0.042, 0.034), rigid=True, softness=0.15)
    many_legs(
        body,
        ((0.3, 42), (0.05, -4), (-0.2, -38)),
        parent="root",
        start=(0.15, 0.17),
        reach=0.46,
        rise=0.1,
        radius=0.034,
    )
    body.move("chest.0", Y, -14, 14)
    body.move("chest.0", Z, -12, 12)
    body.move("head.0", Z, -30, 25)
    body.move("head.0", Y, -25, 25)
    return body.skeleton(heading=16)


SPECIES = {
    "ant": ant,
    "beetle": beetle,
}
