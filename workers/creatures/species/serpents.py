"""Snake and worm: nothing but a spine."""

import numpy as np

from workers.creatures.builder import SkeletonBuilder, Y, Z, beside
from workers.creatures.skeleton import Skeleton


def snake(rng: np.random.Generator) -> Skeleton:
    """A long body in bends, the head raised.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (0.0, 0.07, 0.0))
    long, swing = body.vary(2.2, 0.1), body.vary(0.22, 0.2)
    count = 28
    shares = np.linspace(0.0, 1.0, count + 1)
    xs = (0.5 - shares) * long * 0.75
    zs = swing * np.sin(shares * 2.1 * 2 * np.pi) * np.minimum(1.0, 4.0 * shares)
    lift = 0.38 * np.clip(1.0 - shares / 0.2, 0.0, 1.0) ** 1.2
    points = np.stack([xs, 0.07 + lift, zs], axis=1)
    radii = np.interp(shares, [0, 0.08, 0.35, 0.65, 1.0], [0.055, 0.058, 0.075, 0.068, 0.022])
    half = count // 2
    body.limb("rear", "root", points[half:].tolist(), radii[half:].tolist(), jitter=0.03)
    body.limb(
        "front",
        "root",
        points[: half + 1][::-1].tolist(),
        radii[: half + 1][::-1].tolist(),
        jitter=0.03,
    )
    nose = beside(points[0], 0.03, 0.03, 0)
    body.limb(
        "head",
        f"front.{half - 1}",
        [nose, beside(nose, 0.15, -0.02, 0)],
        (0.085, 0.052),
        flat=Y,
        ratio=0.68,
    )
    for capsule in ("rear", "front"):
        body.curl(capsule, Y, -70, 70)
        body.wave(capsule, Y, 20, 1.0)
        body.curl(capsule, Z, -14, 14)
    body.move("head.0", Y, -30, 30)
    return body.skeleton(heading=15, lean=25)


def worm(rng: np.random.Generator) -> Skeleton:
    """An earthworm: a thick tube of rings with a saddle, blunt at both ends.

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
    long, thick = body.vary(1.25, 0.15), body.vary(0.092, 0.15)
    count = 14
    shares = np.linspace(-0.5, 0.5, count + 1)
    hump = body.vary(0.3, 0.2)
    points = np.stack(
        [-long * shares, 0.1 + hump * np.exp(-((shares / 0.17) ** 2)), 0.07 * np.sin(7 * shares)],
        axis=1,
    )
    radii = thick * np.interp(np.abs(shares), [0, 0.4, 0.5], [1.0, 0.95, 0.7])
    half = count // 2
    body.limb("rear", "root", points[half:].tolist(), radii[half:].tolist(), jitter=0.02)
    body.limb(
        "front",
        "root",
        points[: half + 1][::-1].tolist(),
        radii[: half + 1][::-1].tolist(),
        jitter=0.02,
    )
    for capsule in ("rear", "front"):
        for i in range(half):
            for share in (0.0, 0.5):
                saddle = capsule == "front" and i in (3, 4)
                ring = (1.26 if saddle else 1.09) * thick * (0.9 if i == half - 1 else 1.0)
                way = body.at(f"{capsule}.{i}", 1.0) - body.at(f"{capsule}.{i}")
                pitch, yaw = (
                    np.degrees(np.arctan2(way[1], np.hypot(way[0], way[2]))),
                    np.degrees(np.arctan2(-way[2], way[0])),
                )
                body.blob(
                    f"{capsule}.{i}",
                    body.at(f"{capsule}.{i}", share),
                    (0.6 * thick if saddle else 0.38 * thick, ring, ring),
                    pitch=float(pitch),
                    yaw=float(-yaw),
                    softness=0.12,
                    jitter=0.02,
                )
        body.curl(capsule, Y, -110, 110)
        body.curl(capsule, Z, -40, 40)
        body.wave(capsule, Y, 14, 1.0)
    return body.skeleton(heading=0)


SPECIES = {
    "snake": snake,
    "worm": worm,
}
