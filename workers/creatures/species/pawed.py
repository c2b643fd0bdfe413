"""Four-legged animals on paws."""

import numpy as np

from workers.creatures.builder import Z
from workers.creatures.skeleton import Skeleton
from workers.creatures.species.quadruped import Build, quadruped


def dog(rng: np.random.Generator) -> Skeleton:
    """Deep chest, slim waist, a muzzle with a stop, hanging ears and a raised tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = quadruped(
        rng,
        Build(
            length=0.62,
            height=0.66,
            girth=(0.125, 0.115, 0.155),
            narrow=0.78,
            stance=0.095,
            leg=(0.078, 0.05, 0.036, 0.036),
            paw=0.045,
            neck=(0.25, 48),
            neck_radii=(0.105, 0.08),
            head=(0.27, -14),
            head_radii=(0.105, 0.055),
            ear=(0.16, 0.055),
            ear_tilt=155,
            tail=(0.36, 30, -75),
            tail_radii=(0.04, 0.026),
        ),
    )
    body.blob("head.0", body.at("head.0", 0.95, (0, 0.02, 0)), (0.03, 0.03, 0.035))
    return body.skeleton(heading=12)


def cat(rng: np.random.Generator) -> Skeleton:
    """Long low body, round head with pointed ears, a long curved tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = quadruped(
        rng,
        Build(
            length=0.6,
            height=0.47,
            girth=(0.12, 0.115, 0.118),
            narrow=0.82,
            stance=0.08,
            leg=(0.066, 0.045, 0.035, 0.034),
            paw=0.035,
            neck=(0.17, 45),
            neck_radii=(0.092, 0.08),
            head=(0.07, -12),
            head_radii=(0.125, 0.09),
            ear=(0.115, 0.055),
            ear_tilt=18,
            tail=(0.66, 10, -100),
            tail_radii=(0.032, 0.024),
        ),
    )
    return body.skeleton(heading=8)


def lion(rng: np.random.Generator) -> Skeleton:
    """A cat's body, large, with a mane around the head and a tuft on the tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = quadruped(
        rng,
        Build(
            length=0.84,
            height=0.74,
            girth=(0.155, 0.155, 0.19),
            narrow=0.8,
            stance=0.12,
            leg=(0.1, 0.072, 0.056, 0.054),
            paw=0.06,
            neck=(0.26, 42),
            neck_radii=(0.17, 0.15),
            head=(0.2, -12),
            head_radii=(0.16, 0.115),
            ear=(0.22, 0.07),
            ear_tilt=38,
            tail=(0.78, -28, 18),
            tail_radii=(0.036, 0.03),
        ),
    )
    crown = body.at("neck.2", 1.0, (-0.07, -0.02, 0))
    body.blob("neck.2", crown, (0.14, 0.33, 0.31), pitch=-8, softness=0.06)  # mane
    body.blob("neck.0", body.at("neck.0", 0.6, (0.06, -0.1, 0)), (0.16, 0.24, 0.19), pitch=15)
    body.blob("head.0", body.at("head.0", 0.8, (0, -0.02, 0)), (0.075, 0.08, 0.085))
    body.blob("tail.4", body.at("tail.4", 1.0), (0.085, 0.06, 0.06), pitch=-30)
    return body.skeleton(heading=20)


def rabbit(rng: np.random.Generator) -> Skeleton:
    """Long ears, round back, strong hind legs, a ball for a tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = quadruped(
        rng,
        Build(
            length=0.34,
            height=0.33,
            girth=(0.17, 0.17, 0.125),
            narrow=0.88,
            stance=0.088,
            leg=(0.066, 0.046, 0.036, 0.036),
            paw=0.035,
            neck=(0.13, 55),
            neck_radii=(0.1, 0.085),
            head=(0.1, -18),
            head_radii=(0.115, 0.078),
            ear=(0.27, 0.05),
            ear_tilt=14,
            tail=(0.05, 30, 0),
            tail_radii=(0.06, 0.06),
        ),
    )
    body.blob(
        "hindleg.0",
        body.at("hindleg.0", 0.4, (0.02, 0, 0.02)),
        (0.13, 0.12, 0.055),
        mirrored=True,
        pitch=-20,
    )
    body.blob(
        "hindleg.2", body.at("hindleg.2", 1.0, (0.1, 0, 0)), (0.12, 0.034, 0.04), mirrored=True
    )
    body.curl("ear", Z, -20, 20)
    return body.skeleton(heading=15)


SPECIES = {
    "dog": dog,
    "cat": cat,
    "lion": lion,
    "rabbit": rabbit,
}
