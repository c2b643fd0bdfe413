"""Octopus, squid and starfish: many arms without bones."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton


def octopus(rng: np.random.Generator) -> Skeleton:
    """A bulb of a head with two eyes over eight arms.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.5, 0.0))
    head, reach = body.vary(0.24, 0.1), body.vary(0.95, 0.1)
    body.limb(
        "mantle", "root", [(0, 0.48, 0), (-0.06, 0.66, 0), (-0.14, 0.9, 0)], (0.15, 0.17, head)
    )
    body.blob("mantle.0", (0.1, 0.6, 0.11), (0.07, 0.07, 0.06), mirrored=True)
    for number, angle in enumerate((20, 66, 114, 160)):
        turn = np.radians(angle)
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        points = []
        for i in range(8):
            share = i / 7
            height = (
                0.46
                - 0.4 * np.sin(min(1.0, 1.5 * share) * np.pi / 2)
                + 0.14 * max(0.0, share - 0.66) * 3
            )
            points.append((0.07 + reach * share) * out + np.array([0.0, height, 0.0]))
        name = f"arm{number}"
        body.limb(
            name, "root", points, np.linspace(0.088, 0.032, 8).tolist(), mirrored=True, softness=0.2
        )
        body.curl(name, Y, -80, 80)
        body.curl(name, (float(-out[2]), 0.0, float(out[0])), -50, 40)
        body.wave(name, Y, 12, 1.0)
    body.curl("mantle", Z, -30, 20)
    body.curl("mantle", X, -25, 25)
    return body.skeleton(heading=75)


def squid(rng: np.random.Generator) -> Skeleton:
    """A pointed mantle with two fins, eight short arms and two long tentacles.

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
    long, wide = body.vary(0.8, 0.1), body.vary(0.19, 0.1)
    points = [(0, 0, 0), (0.3 * long, 0, 0), (0.65 * long, 0, 0), (long, 0, 0)]
    body.limb("mantle", "root", points, (0.95 * wide, wide, 0.72 * wide, 0.035))
    body.limb(
        "fin",
        "mantle.2",
        [(0.72 * long, 0, 0.05), (0.7 * long, 0, 0.24), (0.58 * long, 0, 0.4)],
        (0.22, 0.15, 0.036),
        mirrored=True,
        flat=Y,
        ratio=0.16,
        softness=0.2,
    )
    body.limb("head", "root", [(0, 0, 0), (-0.17, 0, 0)], (0.12, 0.175), softness=0.15)
    body.blob("head.0", (-0.12, 0.03, 0.14), (0.06, 0.06, 0.05), mirrored=True)
    for number, angle in enumerate((68, -23, -68)):
        turn = np.radians(angle)
        out = np.array([0.0, np.sin(turn), np.cos(turn)])
        spread, count = body.vary(0.32, 0.1), 5
        arm = [
            np.array([-0.22 - 0.46 * i / count, 0, 0]) + (0.155 + spread * (i / count)) * out
            for i in range(count + 1)
        ]
        name = f"arm{number}"
        body.limb(
            name,
            "head.0",
            arm,
            np.linspace(0.036, 0.025, count + 1).tolist(),
            mirrored=True,
            softness=0.12,
        )
        for axis in (Y, Z):
            body.curl(name, axis, -35, 35)
    tip = body.vary(0.95, 0.1)
    tentacle = [(-0.22 - tip * i / 7, 0.06 + 0.2 * i / 7, 0.14 + 0.5 * i / 7) for i in range(8)]
    body.limb(
        "tentacle",
        "head.0",
        tentacle,
        (0.034, 0.03, 0.027, 0.026, 0.026, 0.026, 0.045, 0.03),
        mirrored=True,
        softness=0.12,
    )
    for axis in (Y, Z):
        body.curl("tentacle", axis, -45, 45)
    body.wave("tentacle", Y, 14, 1.0)
    body.curl("mantle", Y, -18, 18)
    body.curl("mantle", Z, -18, 18)
    body.curl("fin", X, -45, 45)
    return body.skeleton(heading=-25, lean=45)


def starfish(rng: np.random.Generator) -> Skeleton:
    """Five tapering arms in a plane that faces the viewer.

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
    body.blob("root", (0, 0, 0), (0.15, 0.25, 0.25))
    reach, thick = body.vary(0.72, 0.12), body.vary(0.18, 0.14)
    for number in range(5):
        turn = np.radians(90 + 72 * number)
        out = np.array([0.0, np.sin(turn), np.cos(turn)])
        own = body.vary(reach, 0.06)
        points = [(0.08 + own * i / 5) * out for i in range(6)]
        body.limb(
            f"arm{number}",
            "root",
            points,
            np.linspace(thick, 0.052, 6).tolist(),
            flat=X,
            ratio=0.62,
        )
        body.curl(f"arm{number}", X, -55, 55)
        across = np.cross(out, [1.0, 0.0, 0.0])
        body.curl(f"arm{number}", across.tolist(), -50, 50)
    return body.skeleton(heading=62)


SPECIES = {
    "octopus": octopus,
    "squid": squid,
    "starfish": starfish,
}
