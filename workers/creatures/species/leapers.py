"""Two on strong hind legs: a dinosaur and a frog."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton


def dinosaur(rng: np.random.Generator) -> Skeleton:
    """Tyrannosaurus: huge head and tail in balance over two strong legs, tiny arms.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.82, 0.0))
    tail = body.vary(0.95, 0.1)
    body.limb(
        "spine",
        "root",
        [(-0.05, 0.84, 0), (0.18, 0.86, 0), (0.38, 0.94, 0)],
        (0.185, 0.2, 0.14),
        flat=Z,
        ratio=0.82,
    )
    body.limb(
        "tail",
        "root",
        [(-0.05 - tail * i / 7, 0.84 + 0.01 * i, 0) for i in range(8)],
        np.linspace(0.17, 0.032, 8).tolist(),
    )
    body.limb(
        "neck", "spine.1", [(0.38, 0.94, 0), (0.48, 1.06, 0), (0.54, 1.18, 0)], (0.13, 0.105, 0.1)
    )
    snout = body.vary(0.33, 0.12)
    body.limb(
        "head",
        "neck.1",
        [(0.54, 1.21, 0), (0.58 + snout, 1.19, 0)],
        (0.135, 0.085),
        flat=Z,
        ratio=0.75,
    )
    body.limb(
        "jaw",
        "neck.1",
        [(0.56, 1.11, 0), (0.54 + snout, 1.0, 0)],
        (0.065, 0.05),
        flat=Z,
        ratio=0.9,
        softness=0.1,
    )
    body.blob("head.0", (0.62, 1.3, 0.065), (0.06, 0.045, 0.035), mirrored=True)
    body.limb(
        "arm",
        "spine.1",
        [(0.4, 0.84, 0.1), (0.42, 0.72, 0.15), (0.53, 0.7, 0.15)],
        (0.042, 0.032, 0.032),
        mirrored=True,
    )
    body.limb(
        "leg",
        "root",
        [(-0.02, 0.8, 0.13), (0.12, 0.5, 0.18), (-0.1, 0.28, 0.18), (0.0, 0.06, 0.18)],
        (0.165, 0.1, 0.062, 0.055),
        mirrored=True,
    )
    body.limb(
        "toe",
        "leg.2",
        [(-0.02, 0.05, 0.18), (0.17, 0.04, 0.2)],
        (0.065, 0.05),
        mirrored=True,
        flat=Y,
        ratio=0.8,
    )
    body.curl("tail", Y, -80, 80)
    body.curl("tail", Z, -35, 35)
    body.curl("spine", Z, -18, 12)
    body.curl("neck", Z, -25, 25)
    body.curl("neck", Y, -40, 40)
    body.move("jaw.0", Z, -12, 14)
    body.move("arm.0", Z, -30, 30)
    body.move("arm.1", Z, -20, 30)
    body.move("leg.0", Z, -28, 32)
    body.move("leg.1", Z, -30, 18)
    body.move("leg.2", Z, -15, 35)
    return body.skeleton(heading=0)


def frog(rng: np.random.Generator) -> Skeleton:
    """Squat, wide mouth, eyes on top, long folded hind legs with webbed feet.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.22, 0.0))
    wide = body.vary(0.2, 0.1)
    body.limb(
        "spine",
        "root",
        [(-0.22, 0.17, 0), (0.0, 0.27, 0), (0.18, 0.38, 0)],
        (0.13, 1.05 * wide, 0.9 * wide),
        flat=Y,
        ratio=0.78,
    )
    body.limb(
        "head", "spine.1", [(0.24, 0.44, 0), (0.36, 0.45, 0)], (0.18, 0.12), flat=Y, ratio=0.65
    )
    body.blob("head.0", (0.28, 0.55, 0.115), (0.065, 0.07, 0.06), mirrored=True, softness=0.2)
    body.limb(
        "arm",
        "spine.1",
        [(0.24, 0.28, 0.13), (0.26, 0.16, 0.24), (0.38, 0.04, 0.24)],
        (0.06, 0.045, 0.04),
        mirrored=True,
    )
    body.limb(
        "palm",
        "arm.1",
        [(0.38, 0.035, 0.24), (0.47, 0.03, 0.26)],
        (0.04, 0.06),
        mirrored=True,
        rigid=True,
        flat=Y,
        ratio=0.6,
    )
    body.limb(
        "leg",
        "root",
        [(-0.22, 0.18, 0.1), (0.04, 0.3, 0.36), (-0.3, 0.1, 0.42), (-0.06, 0.05, 0.52)],
        (0.1, 0.08, 0.05, 0.042),
        mirrored=True,
    )
    body.limb(
        "web",
        "leg.2",
        [(-0.06, 0.045, 0.52), (0.1, 0.035, 0.56)],
        (0.045, 0.1),
        mirrored=True,
        flat=Y,
        ratio=0.36,
    )
    body.curl("spine", Z, -10, 14)
    body.move("head.0", Z, -12, 15)
    body.move("head.0", Y, -18, 18)
    body.move("arm.0", Y, -25, 25)
    body.move("arm.1", X, -20, 20)
    body.move("leg.0", Y, -10, 40)
    body.move("leg.1", Y, -50, 5)
    body.move("leg.2", Y, -15, 45)
    return body.skeleton(heading=20)


SPECIES = {
    "dinosaur": dinosaur,
    "frog": frog,
}
