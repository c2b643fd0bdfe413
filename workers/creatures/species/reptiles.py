"""Reptiles on four bent legs."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton


def _sprawling(
    body: SkeletonBuilder,
    name: str,
    parent: str,
    hip: tuple[float, float, float],
    reach: float,
    radius: float,
    lean: float,
) -> None:
    """Add a leg that goes sideways and then down, with a flat foot."""
    x, y, z = hip
    elbow = (x + lean * 0.4 * reach, y - 0.02, z + 0.55 * reach)
    wrist = (x + lean * 0.1 * reach, 0.05, z + 0.8 * reach)
    body.limb(
        name, parent, [hip, elbow, wrist], (1.2 * radius, radius, 0.85 * radius), mirrored=True
    )
    body.limb(
        f"{name}foot",
        f"{name}.1",
        [wrist, (wrist[0] + 0.1, 0.03, wrist[2] + 0.04)],
        (0.8 * radius, 1.0 * radius),
        mirrored=True,
        rigid=True,
        flat=Y,
        ratio=0.7,
    )
    body.move(f"{name}.0", Y, -28, 28)
    body.move(f"{name}.0", X, -14, 12)
    body.move(f"{name}.1", Y, -25, 25)


def crocodile(rng: np.random.Generator) -> Skeleton:
    """Long flat snout, low body, short legs to the sides, a heavy tail with a crest.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.16, 0.0))
    tail = body.vary(0.95, 0.1)
    body.limb("rear", "root", [(0, 0.17, 0), (-0.28, 0.16, 0)], (0.17, 0.14), flat=Y, ratio=0.7)
    body.limb("chest", "root", [(0, 0.17, 0), (0.28, 0.16, 0)], (0.17, 0.135), flat=Y, ratio=0.7)
    points = [(-0.28 - tail * i / 6, 0.15 - 0.012 * i, 0) for i in range(7)]
    body.limb("tail", "rear.0", points, np.linspace(0.135, 0.036, 7).tolist(), flat=Z, ratio=0.75)
    snout = body.vary(0.46, 0.12)
    body.limb(
        "neck", "chest.0", [(0.28, 0.16, 0), (0.45, 0.16, 0)], (0.12, 0.105), flat=Y, ratio=0.8
    )
    body.limb(
        "head",
        "neck.0",
        [(0.45, 0.17, 0), (0.56, 0.19, 0), (0.56 + snout, 0.25, 0)],
        (0.1, 0.115, 0.066),
        flat=Y,
        ratio=0.5,
    )
    body.limb(
        "jaw",
        "neck.0",
        [(0.5, 0.12, 0), (0.53 + snout, 0.07, 0)],
        (0.1, 0.056),
        flat=Y,
        ratio=0.45,
        softness=0.1,
    )
    body.move("jaw.0", Z, -8, 3)
    body.blob("head.0", (0.56, 0.25, 0.055), (0.055, 0.045, 0.036), mirrored=True)
    body.blob("head.1", (0.54 + snout, 0.275, 0), (0.05, 0.035, 0.05))
    for i in range(4):
        body.blob(
            f"tail.{i}",
            body.at(f"tail.{i}", 0.5, (0, 0.1 - 0.016 * i, 0)),
            (0.05, 0.045, 0.028),
            pitch=-20,
            softness=0.15,
        )
    _sprawling(body, "foreleg", "chest.0", (0.24, 0.13, 0.09), 0.26, 0.055, -0.4)
    _sprawling(body, "hindleg", "rear.0", (-0.24, 0.13, 0.09), 0.28, 0.062, 0.5)
    for capsule, angle in (("tail", 75), ("rear", 14), ("chest", 14), ("neck", 22), ("head", 12)):
        body.curl(capsule, Y, -angle, angle)
    body.curl("tail", Z, -25, 15)
    body.curl("neck", Z, -8, 25)
    return body.skeleton(heading=4, lean=16)


def lizard(rng: np.random.Generator) -> Skeleton:
    """A gecko: flat head, thin waist, four splayed legs with pads, a tapering tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.1, 0.0))
    tail = body.vary(0.75, 0.12)
    body.limb("rear", "root", [(0, 0.1, 0), (-0.25, 0.1, 0)], (0.11, 0.075))
    body.limb("chest", "root", [(0, 0.1, 0), (0.22, 0.1, 0)], (0.11, 0.085))
    body.limb(
        "tail",
        "rear.0",
        [(-0.25 - tail * i / 8, 0.095, 0) for i in range(9)],
        np.linspace(0.07, 0.024, 9).tolist(),
    )
    body.limb("neck", "chest.0", [(0.22, 0.1, 0), (0.32, 0.11, 0)], (0.075, 0.072))
    body.limb("head", "neck.0", [(0.36, 0.12, 0), (0.52, 0.11, 0)], (0.11, 0.06), flat=Y, ratio=0.7)
    for name, parent, x, lean in (
        ("foreleg", "chest.0", 0.19, 0.5),
        ("hindleg", "rear.0", -0.22, -0.4),
    ):
        points = [(x, 0.09, 0.06), (x + 0.2 * lean, 0.1, 0.23), (x + 0.55 * lean, 0.05, 0.36)]
        body.limb(name, parent, points, (0.05, 0.04, 0.034), mirrored=True)
        for toe, angle in enumerate((-72, 0, 72)):
            turn = np.radians(angle + 60 * lean)
            end = np.array(points[-1]) + 0.13 * np.array([np.sin(turn), -0.15, np.cos(turn)])
            body.limb(
                f"{name}toe{toe}",
                f"{name}.1",
                [points[-1], end],
                (0.03, 0.032),
                mirrored=True,
                rigid=True,
            )
        body.move(f"{name}.0", Y, -30, 30)
        body.move(f"{name}.1", Y, -30, 30)
        body.move(f"{name}.0", X, -10, 10)
    for capsule, angle in (("tail", 120), ("rear", 22), ("chest", 22), ("neck", 25)):
        body.curl(capsule, Y, -angle, angle)
    body.curl("tail", Z, -20, 20)
    return body.skeleton(heading=35, lean=50)


def turtle(rng: np.random.Generator) -> Skeleton:
    """A domed shell, four flippers, a neck and a short tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.16, 0.0))
    long, wide = body.vary(0.43, 0.08), body.vary(0.35, 0.08)
    dome = body.vary(0.24, 0.14)
    body.blob("root", (0, 0.2, 0), (long, dome, wide), softness=0.1)
    body.blob("root", (0, 0.15, 0), (1.08 * long, 0.075, 1.1 * wide), softness=0.1)
    body.limb(
        "neck",
        "root",
        [(long - 0.06, 0.16, 0), (long + 0.1, 0.2, 0), (long + 0.2, 0.25, 0)],
        (0.09, 0.08, 0.08),
        softness=0.15,
    )
    body.blob("neck.1", (long + 0.25, 0.26, 0), (0.12, 0.09, 0.09), pitch=-8)
    body.limb(
        "flipper",
        "root",
        [(0.26, 0.13, 0.22), (0.34, 0.1, wide + 0.14), (0.24, 0.06, wide + 0.36)],
        (0.09, 0.1, 0.05),
        mirrored=True,
        flat=(0.0, 0.97, 0.2),
        ratio=0.39,
        softness=0.15,
    )
    body.limb(
        "paddle",
        "root",
        [(-0.3, 0.13, 0.18), (-0.44, 0.09, 0.32), (-0.54, 0.06, 0.42)],
        (0.08, 0.085, 0.06),
        mirrored=True,
        flat=(0.0, 0.97, 0.2),
        ratio=0.39,
        softness=0.15,
    )
    body.limb(
        "tail", "root", [(-long, 0.13, 0), (-long - 0.17, 0.1, 0)], (0.055, 0.03), softness=0.15
    )
    body.curl("neck", Y, -50, 50)
    body.curl("neck", Z, -30, 35)
    body.curl("flipper", Y, -40, 30)
    body.curl("flipper", X, -35, 20)
    body.curl("paddle", Y, -30, 30)
    body.curl("paddle", X, -25, 15)
    body.move("tail.0", Y, -35, 35)
    return body.skeleton(heading=18)


SPECIES = {
    "crocodile": crocodile,
    "lizard": lizard,
    "turtle": turtle,
}
