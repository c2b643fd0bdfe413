"""Machines with joints."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z, beside
from workers.creatures.skeleton import Skeleton


def robot(rng: np.random.Generator) -> Skeleton:
    """Boxes for head and trunk, pipes for limbs, an aerial.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.62, 0.0))
    wide, tall = body.vary(0.22, 0.1), body.vary(0.25, 0.1)
    body.limb(
        "spine",
        "root",
        [(0, 0.66, 0), (0, 0.78, 0), (0, 0.9, 0)],
        (0.08, 0.08, 0.08),
        softness=0.12,
    )
    body.blob("root", (0, 0.63, 0), (0.12, 0.08, 0.17), power=8, softness=0.1)
    body.blob("spine.1", (0, 0.83 + tall, 0), (0.16, tall, wide), power=8, softness=0.06)
    top = 0.83 + 2 * tall
    body.limb(
        "neck", "spine.1", [(0, top - 0.02, 0), (0, top + 0.1, 0)], (0.065, 0.065), softness=0.1
    )
    head = body.vary(0.15, 0.12)
    body.blob(
        "neck.0",
        (0.01, top + 0.08 + head, 0),
        (0.9 * head, head, 1.1 * head),
        power=8,
        softness=0.06,
    )
    crown = top + 0.07 + 2 * head
    body.limb(
        "aerial", "neck.0", [(0, crown, 0), (0, crown + 0.15, 0)], (0.027, 0.027), softness=0.1
    )
    body.blob("aerial.0", (0, crown + 0.17, 0), (0.048, 0.048, 0.048))
    body.blob(
        "neck.0",
        (0.9 * head, top + 0.1 + 1.1 * head, 0.45 * head),
        (0.05, 0.045, 0.045),
        mirrored=True,
        softness=0.1,
    )
    arm, hand = wide + 0.09, top - 0.1
    body.limb(
        "shoulder",
        "spine.1",
        [(0, hand, wide - 0.03), (0, hand, arm)],
        (0.06, 0.06),
        mirrored=True,
        softness=0.1,
    )
    body.limb(
        "arm",
        "shoulder.0",
        [(0, hand, arm), (0, hand - 0.22, arm + 0.14), (0.05, hand - 0.45, arm + 0.22)],
        (0.065, 0.055, 0.055),
        mirrored=True,
        softness=0.1,
    )
    wrist = body.at("arm.1", 1.0)
    body.blob("arm.1", wrist, (0.075, 0.06, 0.075), mirrored=True, power=6, softness=0.08)
    for offset in (0.055, -0.055):
        body.limb(
            f"claw{'a' if offset > 0 else 'b'}",
            "arm.1",
            [beside(wrist, offset, -0.02, 0), beside(wrist, 1.3 * offset, -0.14, 0.02)],
            (0.028, 0.028),
            mirrored=True,
            softness=0.08,
        )
    body.limb(
        "leg",
        "root",
        [(0, 0.62, 0.1), (0, 0.34, 0.16), (0, 0.08, 0.2)],
        (0.07, 0.06, 0.06),
        mirrored=True,
        softness=0.1,
    )
    body.blob(
        "leg.0", (0.0, 0.34, 0.16), (0.075, 0.06, 0.07), mirrored=True, power=4, softness=0.08
    )
    body.limb(
        "foot",
        "leg.1",
        [(0, 0.06, 0.2), (0.1, 0.06, 0.2)],
        (0.05, 0.05),
        mirrored=True,
        softness=0.1,
    )
    body.blob(
        "foot.0", (0.05, 0.05, 0.2), (0.14, 0.055, 0.09), mirrored=True, power=7, softness=0.06
    )
    body.curl("spine", Y, -35, 35)
    body.curl("spine", Z, -15, 8)
    body.move("neck.0", Y, -45, 45)
    body.move("aerial.0", X, -15, 15)
    body.move("arm.0", Z, -50, 80)
    body.move("arm.0", X, -50, 12)
    body.move("arm.1", Z, 0, 80)
    body.move("leg.0", Z, -30, 50)
    body.move("leg.1", Z, -60, 0)
    body.move("foot.0", Z, -15, 15)
    return body.skeleton(heading=75)


def lamp(rng: np.random.Generator) -> Skeleton:
    """A desk lamp: a round foot, two arms with joints, a shade.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.05, 0.0))
    lower, upper = body.vary(0.55, 0.1), body.vary(0.5, 0.1)
    body.blob("root", (0, 0.05, 0), (0.24, 0.055, 0.24), softness=0.15)
    elbow = np.array([-0.2, 0.08 + lower, 0])
    wrist = elbow + upper * np.array([0.75, 0.5, 0])
    body.limb("arm", "root", [(0, 0.06, 0), elbow, wrist], (0.042, 0.042, 0.042), softness=0.15)
    body.blob("arm.1", elbow, (0.065, 0.065, 0.055), softness=0.15)
    down = np.array([0.6, -0.8, 0])
    cone = [wrist, wrist + 0.1 * down, wrist + 0.24 * down]
    body.limb("shade", "arm.1", cone, (0.075, 0.09, 0.16), softness=0.15)
    rim = (wrist + 0.3 * down).tolist()
    body.blob("shade.1", rim, (0.06, 0.23, 0.23), pitch=-53, power=2.5, softness=0.15)
    body.move("arm.0", Z, -30, 25)
    body.move("arm.1", Z, -35, 40)
    body.move("arm.0", Y, -45, 45)
    body.move("shade.0", Z, -35, 45)
    body.move("shade.0", Y, -35, 35)
    return body.skeleton(heading=5)


SPECIES = {
    "robot": robot,
    "lamp": lamp,
}
