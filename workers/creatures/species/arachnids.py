"""Spider, scorpion and crab: creatures on eight legs, some with claws."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z, beside
from workers.creatures.skeleton import Skeleton
from workers.creatures.species.insects import many_legs

Offset = tuple[float, float, float]


def spider(rng: np.random.Generator) -> Skeleton:
    """Two beads and eight long arched legs.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.32, 0.0))
    rear = body.vary(0.27, 0.12)
    body.blob("root", (0.07, 0.32, 0), (0.21, 0.11, 0.16), softness=0.15)
    body.limb("waist", "root", [(-0.1, 0.32, 0), (-0.2, 0.35, 0)], (0.055, 0.06), softness=0.15)
    body.blob(
        "waist.0",
        (-0.22 - 0.85 * rear, 0.4, 0),
        (rear, 0.74 * rear, 0.8 * rear),
        pitch=-12,
        softness=0.15,
    )
    body.limb(
        "palp",
        "root",
        [(0.23, 0.28, 0.055), (0.32, 0.23, 0.075), (0.34, 0.12, 0.075)],
        (0.034, 0.032, 0.03),
        mirrored=True,
        softness=0.15,
    )
    places = ((0.2, 58), (0.12, 20), (0.02, -14), (-0.06, -46))
    many_legs(body, places, parent="root", start=(0.32, 0.1), reach=0.85, rise=0.33, radius=0.034)
    body.move("waist.0", Z, -20, 20)
    body.move("waist.0", Y, -20, 20)
    body.move("palp.0", Y, -15, 15)
    return body.skeleton(heading=25)


def scorpion(rng: np.random.Generator) -> Skeleton:
    """Claws held forwards, eight legs, a tail arched over the back with a sting.

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
    body.limb(
        "spine",
        "root",
        [(0.24, 0.2, 0), (0.0, 0.21, 0), (-0.3, 0.22, 0)],
        (0.13, 0.16, 0.1),
        flat=Y,
        ratio=0.65,
    )
    tail, scale = [(-0.3, 0.22, 0)], body.vary(0.16, 0.1)
    for angle in (165, 135, 100, 62, 25, -15):
        x, y, z = tail[-1]
        tail.append(
            (
                x + scale * float(np.cos(np.radians(angle))),
                y + scale * float(np.sin(np.radians(angle))),
                z,
            )
        )
    body.limb("tail", "spine.1", tail, (0.07, 0.062, 0.06, 0.056, 0.054, 0.052, 0.05), softness=0.2)
    x, y, _ = tail[-1]
    body.blob("tail.5", (x + 0.01, y, 0), (0.085, 0.07, 0.065), pitch=-30, softness=0.2)
    body.limb(
        "sting",
        "tail.5",
        [(x + 0.04, y - 0.03, 0), (x + 0.13, y - 0.13, 0)],
        (0.04, 0.025),
        rigid=True,
    )
    claw = body.vary(1.0, 0.14)
    arm = [(0.3, 0.2, 0.09), (0.45, 0.22, 0.27), (0.64, 0.2, 0.3)]
    body.limb("arm", "root", arm, (0.045, 0.042, 0.045), mirrored=True, softness=0.2)
    body.limb(
        "palm",
        "arm.1",
        [(0.64, 0.2, 0.3), (0.64 + 0.13 * claw, 0.2, 0.29)],
        (0.06 * claw, 0.078 * claw),
        mirrored=True,
        softness=0.2,
    )
    _add_fingers(
        body,
        claw,
        fixed=((0.15, 0, 0.085), (0.25, 0, 0.05)),
        moving=((0.12, 0, -0.09), (0.21, 0, -0.09)),
        radii=((0.04, 0.034, 0.026), (0.036, 0.032, 0.026)),
        root=0.03,
    )
    many_legs(
        body,
        ((0.12, 26), (0.02, 4), (-0.08, -18), (-0.18, -42)),
        parent="root",
        start=(0.18, 0.1),
        reach=0.46,
        rise=0.12,
        radius=0.029,
    )
    body.curl("tail", Z, -60, 50)
    body.curl("tail", X, -50, 50)
    body.curl("spine", Y, -20, 20)
    body.move("arm.0", Y, -20, 18)
    body.move("arm.1", Y, -25, 20)
    body.move("arm.0", Z, -5, 15)
    return body.skeleton(heading=18)


def crab(rng: np.random.Generator) -> Skeleton:
    """A broad shell, eight legs to the sides, two claws held out, eyes on stalks.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.26, 0.0))
    wide = body.vary(0.36, 0.1)
    body.blob("root", (0, 0.28, 0), (0.25, 0.13, wide), softness=0.15)
    body.limb(
        "eye",
        "root",
        [(0.2, 0.34, 0.09), (0.25, 0.45, 0.1)],
        (0.03, 0.036),
        mirrored=True,
        softness=0.15,
    )
    arm = [(0.2, 0.28, 0.15), (0.3, 0.3, 0.42), (0.48, 0.32, 0.44)]
    body.limb("arm", "root", arm, (0.055, 0.055, 0.055), mirrored=True, softness=0.2)
    claw = body.vary(1.0, 0.15)
    base = np.array(arm[-1])
    body.limb(
        "palm",
        "arm.1",
        [base, base + np.array([0.12, 0.02, -0.03]) * claw],
        (0.065 * claw, 0.09 * claw),
        mirrored=True,
        softness=0.2,
    )
    _add_fingers(
        body,
        claw,
        fixed=((0.16, 0.02, 0.085), (0.31, 0.03, 0.04)),
        moving=((0.13, 0.02, -0.12), (0.25, 0.03, -0.13)),
        radii=((0.05, 0.048, 0.027), (0.045, 0.042, 0.027)),
        root=0.02,
    )
    many_legs(
        body,
        ((0.04, 16), (-0.03, -4), (-0.1, -24), (-0.16, -46)),
        parent="root",
        start=(0.25, 0.26),
        reach=0.5,
        rise=0.15,
        radius=0.038,
    )
    body.move("arm.0", Y, -22, 18)
    body.move("arm.0", X, -20, 15)
    body.move("arm.1", Z, -15, 25)
    body.move("pincer.0", Y, -12, 12)
    body.move("eye.0", Z, -25, 25)
    return body.skeleton(heading=-118, lean=42)


def _add_fingers(
    body: SkeletonBuilder,
    claw: float,
    *,
    fixed: tuple[Offset, Offset],
    moving: tuple[Offset, Offset],
    radii: tuple[Offset, Offset],
    root: float,
) -> None:
    """Add two fingers to the limb ``palm``: one that keeps its place, one that opens.

    Offsets are from the palm's end, forwards ones in units of the claw's length.
    """
    end = body.at("palm.0", 1.0)
    for name, points, thickness in (("finger", fixed, radii[0]), ("pincer", moving, radii[1])):
        side = 0.05 if name == "finger" else -0.05
        body.limb(
            name,
            "palm.0",
            [beside(end, root, 0, side), *(beside(end, x * claw, y, z) for x, y, z in points)],
            thickness,
            mirrored=True,
            rigid=name == "finger",
            softness=0.1,
        )


SPECIES = {
    "spider": spider,
    "scorpion": scorpion,
    "crab": crab,
}
