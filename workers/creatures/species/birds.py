"""Birds: one that flies, one that runs, one that swims."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z, beside
from workers.creatures.skeleton import Skeleton


def bird(rng: np.random.Generator) -> Skeleton:
    """Wings spread, a fanned tail, a beak and two legs.

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
    long, span = body.vary(0.24, 0.12), body.vary(0.36, 0.12)
    body.limb("spine", "root", [(-long, 0, 0), (0, 0, 0), (long, 0.02, 0)], (0.08, 0.16, 0.14))
    neck = [(long, 0.04, 0), (long + 0.1, 0.12, 0)]
    body.limb("neck", "spine.1", neck, (0.1, 0.08))
    body.blob("neck.0", (long + 0.13, 0.15, 0), (0.1, 0.09, 0.085))
    body.limb(
        "beak",
        "neck.0",
        [(long + 0.2, 0.15, 0), (long + 0.31, 0.11, 0)],
        (0.045, 0.024),
        rigid=True,
        softness=0.12,
    )
    up = np.radians(24)
    wing = [np.array([0.1, 0.06, 0.06])]
    for share, sweep in ((0.3, 0.06), (0.35, -0.05), (0.35, -0.16)):
        wing.append(wing[-1] + span * share * 2 * np.array([sweep, np.sin(up), np.cos(up)]))
    flat = (0.0, float(np.cos(up)), float(-np.sin(up)))
    body.limb(
        "wing",
        "spine.1",
        wing,
        (0.13, 0.17, 0.15, 0.06),
        mirrored=True,
        flat=flat,
        ratio=0.16,
        softness=0.12,
    )
    body.limb(
        "tail",
        "spine.0",
        [(-long, 0.01, 0), (-long - 0.17, 0.0, 0), (-long - 0.3, -0.01, 0)],
        (0.06, 0.1, 0.14),
        flat=Y,
        ratio=0.22,
        softness=0.15,
    )
    body.limb(
        "leg",
        "root",
        [(-0.04, -0.08, 0.06), (-0.06, -0.2, 0.07), (-0.04, -0.29, 0.07)],
        (0.05, 0.027, 0.026),
        mirrored=True,
    )
    body.limb(
        "toe",
        "leg.1",
        [(-0.08, -0.3, 0.07), (0.04, -0.3, 0.075)],
        (0.026, 0.026),
        mirrored=True,
        rigid=True,
    )
    body.curl("wing", X, -50, 50)
    body.curl("wing", Y, -28, 10)
    body.curl("wing", Z, -12, 12)
    body.curl("tail", Z, -30, 30)
    body.curl("tail", X, -20, 20)
    body.move("neck.0", Y, -40, 40)
    body.move("neck.0", Z, -25, 30)
    body.move("leg.0", Z, -50, 30)
    body.move("leg.1", Z, -10, 40)
    return body.skeleton(heading=25)


def ostrich(rng: np.random.Generator) -> Skeleton:
    """A ball of feathers on two long legs, a bare neck, a small head.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (-0.1, 1.0, 0.0))
    leg, neck = body.vary(0.95, 0.08), body.vary(0.75, 0.1)
    body.blob("root", (-0.05, leg + 0.2, 0), (0.36, 0.235, 0.22), pitch=8)
    body.limb(
        "tail",
        "root",
        [(-0.32, leg + 0.2, 0), (-0.46, leg + 0.2, 0), (-0.56, leg + 0.12, 0)],
        (0.13, 0.12, 0.07),
    )
    points = [
        (0.2, leg + 0.24, 0),
        (0.33, leg + 0.3, 0),
        (0.38, leg + 0.3 + neck / 3, 0),
        (0.36, leg + 0.3 + 2 * neck / 3, 0),
        (0.42, leg + 0.32 + neck, 0),
    ]
    body.limb("neck", "root", points, (0.12, 0.075, 0.052, 0.045, 0.045))
    top = np.array(points[-1])
    body.blob("neck.3", beside(top, 0.03, 0.02, 0), (0.085, 0.065, 0.06))
    body.limb(
        "beak",
        "neck.3",
        [beside(top, 0.08, 0.01, 0), beside(top, 0.2, -0.02, 0)],
        (0.045, 0.03),
        rigid=True,
    )
    body.limb(
        "leg",
        "root",
        [
            (-0.06, leg + 0.06, 0.1),
            (0.08, 0.72 * leg, 0.12),
            (-0.08, 0.4 * leg, 0.13),
            (0.0, 0.045, 0.14),
        ],
        (0.13, 0.085, 0.045, 0.04),
        mirrored=True,
    )
    body.limb(
        "toe", "leg.2", [(-0.02, 0.04, 0.14), (0.16, 0.035, 0.15)], (0.045, 0.035), mirrored=True
    )
    body.blob("root", (-0.08, leg + 0.26, 0.19), (0.24, 0.13, 0.07), mirrored=True, pitch=10)
    body.curl("neck", Z, -80, 30)
    body.curl("neck", Y, -40, 40)
    body.move("neck.3", Z, -10, 30)
    body.curl("tail", Z, -20, 25)
    body.move("leg.0", Z, -30, 32)
    body.move("leg.1", Z, -55, 15)
    body.move("leg.2", Z, -5, 45)
    body.move("toe.0", Z, -15, 25)
    return body.skeleton(heading=5)


def penguin(rng: np.random.Generator) -> Skeleton:
    """An upright cone with flippers and a short beak.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.2, 0.0))
    tall, wide = body.vary(0.95, 0.08), body.vary(0.25, 0.08)
    body.limb(
        "spine",
        "root",
        [(0, 0.24, 0), (0.01, 0.3 + 0.3 * tall, 0), (0, 0.68 * tall, 0), (0, 0.84 * tall, 0)],
        (wide, 1.04 * wide, 0.72 * wide, 0.5 * wide),
        flat=X,
        ratio=0.88,
    )
    body.blob("spine.2", (0.02, 0.98 * tall, 0), (0.13, 0.125, 0.115))
    body.limb(
        "beak",
        "spine.2",
        [(0.12, 0.98 * tall, 0), (0.27, 0.955 * tall, 0)],
        (0.045, 0.024),
        rigid=True,
        softness=0.12,
    )
    body.limb(
        "flipper",
        "spine.1",
        [
            (0, 0.7 * tall, 0.7 * wide),
            (-0.02, 0.52 * tall, wide + 0.11),
            (-0.04, 0.34 * tall, 1.3 * wide + 0.22),
        ],
        (0.075, 0.085, 0.045),
        mirrored=True,
        flat=(0.0, 0.5, 0.87),
        ratio=0.3,
        softness=0.2,
    )
    body.limb(
        "foot",
        "root",
        [(0.02, 0.06, 0.12), (0.2, 0.03, 0.16)],
        (0.06, 0.075),
        mirrored=True,
        flat=Y,
        ratio=0.38,
    )
    body.limb(
        "tail", "root", [(-0.18, 0.12, 0), (-0.34, 0.05, 0)], (0.09, 0.05), flat=Y, ratio=0.39
    )
    body.curl("spine", X, -30, 30)
    body.curl("spine", Z, -25, 12)
    body.curl("spine", Y, -30, 30)
    body.move("flipper.0", X, -50, 8)
    body.move("flipper.0", Y, -40, 25)
    body.move("flipper.1", X, -25, 15)
    body.move("foot.0", Y, -20, 20)
    body.move("tail.0", Y, -25, 25)
    return body.skeleton(heading=62)


SPECIES = {"bird": bird, "ostrich": ostrich, "penguin": penguin}
