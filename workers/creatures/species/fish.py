"""Swimmers: fish, shark, ray and dolphin."""

import numpy as np

from workers.creatures.builder import Point, SkeletonBuilder, X, Y, Z, beside
from workers.creatures.skeleton import Skeleton


def _trunk(
    body: SkeletonBuilder, length: float, depth: float, profile: tuple[float, ...], ratio: float
) -> None:
    """Spine from nose to the root of the tail, bones from the middle outwards both ways."""
    xs = np.linspace(0.5, -0.5, len(profile)) * length
    middle = (len(profile) - 1) // 2
    front = [(float(x), 0.0, 0.0) for x in xs[: middle + 1][::-1]]
    rear = [(float(x), 0.0, 0.0) for x in xs[middle:]]
    radii = [depth * share for share in profile]
    body.limb("chest", "root", front, radii[: middle + 1][::-1], flat=Z, ratio=ratio)
    body.limb("spine", "root", rear, radii[middle:], flat=Z, ratio=ratio)


def fish(rng: np.random.Generator) -> Skeleton:
    """Flat sides, a forked tail, a sail on the back and two small fins.

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
    length, depth = body.vary(0.85, 0.1), body.vary(0.235, 0.14)
    _trunk(body, length, depth, (0.36, 0.78, 1.0, 0.98, 0.75, 0.45, 0.24), 0.5)
    root = body.at("spine.2", 1.0, (0.02, 0, 0))
    for name, sign in (("upper", 1.0), ("lower", -1.0)):
        body.limb(
            name,
            "spine.2",
            [root, beside(root, -0.13, 0.1 * sign, 0), beside(root, -0.25, 0.24 * sign, 0)],
            (0.075, 0.085, 0.045),
            flat=Z,
            ratio=0.3,
            softness=0.2,
        )
    body.limb(
        "sail",
        "root",
        [(0.14, 0.85 * depth, 0), (-0.02, 1.15 * depth, 0), (-0.2, 0.95 * depth, 0)],
        (0.07, 0.095, 0.06),
        rigid=True,
        flat=Z,
        ratio=0.3,
        softness=0.2,
    )
    body.limb(
        "keel",
        "spine.0",
        [(-0.12, -0.75 * depth, 0), (-0.22, -0.9 * depth, 0)],
        (0.06, 0.05),
        rigid=True,
        flat=Z,
        ratio=0.35,
        softness=0.2,
    )
    side = 0.44 * depth
    body.limb(
        "fin",
        "chest.0",
        [(0.16, -0.06, side), (0.06, -0.11, side + 0.09), (-0.02, -0.15, side + 0.15)],
        (0.04, 0.06, 0.05),
        mirrored=True,
        flat=(0.5, 0.8, 0.5),
        ratio=0.36,
        softness=0.2,
    )
    body.blob(
        "chest.1",
        (0.36 * length, 0.28 * depth, 0.34 * depth),
        (0.04, 0.04, 0.035),
        mirrored=True,
        softness=0.15,
    )
    _swims(body, Y, 45)
    body.move("fin.0", X, -40, 25)
    return body.skeleton(heading=-6)


def _swims(body: SkeletonBuilder, axis: Point, angle: float) -> None:
    body.curl("spine", axis, -angle, angle)
    body.curl("chest", axis, -0.4 * angle, 0.4 * angle)
    body.curl("upper", axis, -25, 25)
    body.curl("lower", axis, -25, 25)


def shark(rng: np.random.Generator) -> Skeleton:
    """A spindle with a tall back fin, long side fins and an uneven tail.

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
    length, depth = body.vary(1.5, 0.08), body.vary(0.175, 0.1)
    _trunk(body, length, depth, (0.3, 0.72, 0.95, 1.0, 0.85, 0.6, 0.36, 0.24), 0.86)
    root = body.at("spine.3", 1.0, (0.04, 0, 0))
    body.limb(
        "upper",
        "spine.3",
        [root, beside(root, -0.13, 0.15, 0), beside(root, -0.27, 0.34, 0)],
        (0.07, 0.075, 0.035),
        flat=Z,
        ratio=0.34,
        softness=0.2,
    )
    body.limb(
        "lower",
        "spine.3",
        [root, beside(root, -0.06, -0.1, 0), beside(root, -0.12, -0.2, 0)],
        (0.06, 0.06, 0.032),
        flat=Z,
        ratio=0.34,
        softness=0.2,
    )
    body.limb(
        "sail",
        "root",
        [(0.06, 0.75 * depth, 0), (-0.03, depth + 0.1, 0), (-0.11, depth + 0.22, 0)],
        (0.14, 0.085, 0.03),
        rigid=True,
        flat=Z,
        ratio=0.25,
        softness=0.2,
    )
    body.limb(
        "second",
        "spine.1",
        [(-0.42, 0.55 * depth, 0), (-0.48, 0.75 * depth + 0.03, 0)],
        (0.06, 0.035),
        rigid=True,
        flat=Z,
        ratio=0.4,
        softness=0.2,
    )
    fin = [(0.26, -0.08, 0.09), (0.16, -0.15, 0.26), (0.03, -0.21, 0.42)]
    body.limb(
        "fin",
        "chest.0",
        fin,
        (0.11, 0.085, 0.032),
        mirrored=True,
        flat=(0.1, 0.9, 0.35),
        ratio=0.25,
        softness=0.2,
    )
    body.limb(
        "pelvic",
        "spine.1",
        [(-0.28, -0.1, 0.06), (-0.36, -0.17, 0.14)],
        (0.06, 0.032),
        mirrored=True,
        rigid=True,
        flat=(0.1, 0.9, 0.5),
        ratio=0.38,
        softness=0.2,
    )
    _swims(body, Y, 55)
    body.move("fin.0", X, -20, 20)
    return body.skeleton(heading=-8)


def dolphin(rng: np.random.Generator) -> Skeleton:
    """A beak, a curved back fin and flat flukes.

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
    length, depth = body.vary(1.3, 0.08), body.vary(0.185, 0.1)
    _trunk(body, length, depth, (0.62, 0.92, 1.0, 0.95, 0.72, 0.45, 0.25), 0.92)
    body.limb(
        "beak",
        "chest.2",
        [(0.5 * length, -0.03, 0), (0.5 * length + 0.23, -0.055, 0)],
        (0.066, 0.042),
        rigid=True,
        softness=0.2,
    )
    root = body.at("spine.2", 1.0, (0.03, 0, 0))
    body.limb(
        "fluke",
        "spine.2",
        [root, beside(root, -0.1, 0, 0.13), beside(root, -0.24, 0, 0.29)],
        (0.075, 0.085, 0.032),
        mirrored=True,
        flat=Y,
        ratio=0.32,
        softness=0.2,
    )
    body.limb(
        "sail",
        "root",
        [(0.03, 0.8 * depth, 0), (-0.06, depth + 0.08, 0), (-0.16, depth + 0.16, 0)],
        (0.12, 0.075, 0.03),
        rigid=True,
        flat=Z,
        ratio=0.28,
        softness=0.2,
    )
    body.limb(
        "fin",
        "chest.0",
        [(0.3, -0.09, 0.11), (0.2, -0.18, 0.22), (0.08, -0.25, 0.3)],
        (0.075, 0.07, 0.032),
        mirrored=True,
        flat=(0.2, 0.75, 0.6),
        ratio=0.32,
        softness=0.2,
    )
    body.curl("spine", Z, -45, 45)
    body.curl("chest", Z, -20, 20)
    body.curl("spine", Y, -20, 20)
    body.curl("fluke", Z, -25, 25)
    body.move("fin.0", X, -30, 20)
    return body.skeleton(heading=-4)


def ray(rng: np.random.Generator) -> Skeleton:
    """A flat diamond with wings and a whip for a tail.

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
    span, tail = body.vary(0.62, 0.1), body.vary(0.85, 0.12)
    body.blob("root", (0, 0, 0), (0.4, 0.085, 0.24))
    body.blob("root", (0.2, 0.03, 0), (0.17, 0.085, 0.14))
    wing = [
        (0.06, 0, 0.1),
        (0.03, 0.02, 0.1 + 0.35 * span),
        (-0.05, 0.05, 0.1 + 0.68 * span),
        (-0.16, 0.09, 0.1 + span),
    ]
    body.limb(
        "wing",
        "root",
        wing,
        (0.34, 0.25, 0.14, 0.035),
        mirrored=True,
        flat=Y,
        ratio=0.13,
        softness=0.3,
    )
    points = [(-0.3 - tail * i / 6, 0.01, 0) for i in range(7)]
    body.limb("tail", "root", points, np.linspace(0.07, 0.025, 7).tolist())
    body.limb(
        "horn",
        "root",
        [(0.34, 0, 0.09), (0.45, -0.01, 0.11)],
        (0.05, 0.034),
        mirrored=True,
        rigid=True,
    )
    body.curl("wing", X, -60, 60)
    body.curl("wing", Z, -15, 15)
    body.curl("tail", Y, -60, 60)
    body.curl("tail", Z, -45, 45)
    return body.skeleton(heading=35, lean=12)


SPECIES = {"fish": fish, "shark": shark, "dolphin": dolphin, "ray": ray}
