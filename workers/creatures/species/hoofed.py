"""Large four-legged animals on hooves and nails."""

import numpy as np

from workers.creatures.builder import X, Y, Z, beside
from workers.creatures.skeleton import Skeleton
from workers.creatures.species.quadruped import Build, arc, quadruped


def horse(rng: np.random.Generator) -> Skeleton:
    """Long legs and neck, a mane, a long head and a full tail.

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
            length=0.86,
            height=1.06,
            girth=(0.215, 0.2, 0.215),
            narrow=0.72,
            stance=0.115,
            leg=(0.105, 0.062, 0.045, 0.042),
            paw=0.03,
            neck=(0.52, 58),
            neck_radii=(0.16, 0.085),
            head=(0.4, -48),
            head_radii=(0.1, 0.058),
            ear=(0.11, 0.034),
            ear_tilt=15,
            tail=(0.72, -15, 68),
            tail_radii=(0.07, 0.05),
        ),
    )
    for i in range(3):
        crest = body.at(f"neck.{i}", 0.5, (-0.13 + 0.018 * i, 0.085 - 0.012 * i, 0))
        body.blob(f"neck.{i}", crest, (0.14, 0.075, 0.036), pitch=55)  # mane
    return body.skeleton(heading=-6)


def cow(rng: np.random.Generator) -> Skeleton:
    """Barrel body, short legs, horns, an udder and a broad muzzle.

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
            length=0.98,
            height=0.92,
            girth=(0.24, 0.265, 0.24),
            narrow=0.78,
            stance=0.15,
            leg=(0.11, 0.07, 0.052, 0.052),
            paw=0.03,
            neck=(0.34, 22),
            neck_radii=(0.18, 0.115),
            head=(0.32, -45),
            head_radii=(0.135, 0.098),
            ear=(0.15, 0.05),
            ear_tilt=95,
            tail=(0.62, -12, 78),
            tail_radii=(0.036, 0.03),
        ),
    )
    base = body.at("head.0", 0.0, (0.03, 0.08, 0.06))
    body.limb(
        "horn",
        "head.0",
        [base, beside(base, 0.0, 0.06, 0.1), beside(base, 0.06, 0.17, 0.13)],
        (0.038, 0.034, 0.024),
        mirrored=True,
        rigid=True,
        softness=0.15,
    )
    body.blob("spine.0", body.at("spine.0", 0.45, (0, -0.26, 0)), (0.12, 0.085, 0.09))
    body.blob("tail.4", body.at("tail.4", 0.9), (0.045, 0.09, 0.045))
    return body.skeleton(heading=0)


def giraffe(rng: np.random.Generator) -> Skeleton:
    """A very long neck, sloping back, long legs, two knobs on the head.

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
            height=1.2,
            girth=(0.165, 0.185, 0.205),
            narrow=0.75,
            stance=0.105,
            leg=(0.085, 0.052, 0.04, 0.042),
            paw=0.025,
            neck=(1.1, 72),
            neck_radii=(0.155, 0.064),
            head=(0.26, -32),
            head_radii=(0.075, 0.045),
            ear=(0.11, 0.03),
            ear_tilt=72,
            tail=(0.5, -35, 48),
            tail_radii=(0.032, 0.028),
        ),
    )
    base = body.at("head.0", 0.05, (-0.01, 0.055, 0.03))
    body.limb(
        "horn",
        "head.0",
        [base, beside(base, -0.02, 0.1, 0.015)],
        (0.024, 0.027),
        mirrored=True,
        rigid=True,
        softness=0.15,
    )
    body.blob("tail.4", body.at("tail.4", 0.9), (0.04, 0.08, 0.04))
    return body.skeleton(heading=10)


def camel(rng: np.random.Generator) -> Skeleton:
    """Two humps, long legs, a neck that dips and rises.

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
            length=0.86,
            height=1.12,
            girth=(0.2, 0.225, 0.22),
            narrow=0.75,
            stance=0.12,
            leg=(0.095, 0.06, 0.048, 0.055),
            paw=0.03,
            neck=(0.85, -22),
            neck_radii=(0.15, 0.082),
            neck_bend=125,
            head=(0.27, -12),
            head_radii=(0.098, 0.07),
            ear=(0.08, 0.03),
            ear_tilt=35,
            tail=(0.42, -25, 60),
            tail_radii=(0.035, 0.028),
        ),
    )
    hump = body.vary(0.2, 0.15)
    for bone, share in (("spine.0", 0.7), ("spine.2", 0.35)):
        top = body.at(bone, share, (0, 0.22, 0))
        body.blob(bone, top, (0.13, hump, 0.105), softness=0.4)
    return body.skeleton(heading=-6)


def pig(rng: np.random.Generator) -> Skeleton:
    """A barrel on short legs, a disc for a snout, a small curly tail.

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
            height=0.46,
            girth=(0.2, 0.22, 0.2),
            narrow=0.85,
            stance=0.11,
            leg=(0.085, 0.06, 0.046, 0.044),
            paw=0.02,
            neck=(0.14, 12),
            neck_radii=(0.18, 0.165),
            head=(0.26, -16),
            head_radii=(0.16, 0.07),
            ear=(0.14, 0.06),
            ear_tilt=35,
            tail=(0.24, 40, -220),
            tail_radii=(0.03, 0.024),
        ),
    )
    body.blob(
        "head.0", body.at("head.0", 1.12), (0.035, 0.078, 0.078), pitch=-16, power=3, softness=0.15
    )
    return body.skeleton(heading=15)


def elephant(rng: np.random.Generator) -> Skeleton:
    """Heavy body on pillars, large flat ears, tusks and a trunk.

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
            length=0.82,
            height=1.0,
            girth=(0.3, 0.335, 0.3),
            narrow=0.82,
            stance=0.19,
            leg=(0.145, 0.115, 0.102, 0.108),
            paw=0.015,
            neck=(0.27, 25),
            neck_radii=(0.23, 0.2),
            head=(0.16, -58),
            head_radii=(0.205, 0.14),
            ear=(0.05, 0.03),
            ear_tilt=80,
            tail=(0.45, -40, 40),
            tail_radii=(0.035, 0.03),
        ),
    )
    trunk = arc(body.at("head.0", 0.9), body.vary(0.95, 0.1), -78, 70, 7)
    body.limb("trunk", "head.0", trunk, np.linspace(0.12, 0.046, 8).tolist())
    base = body.at("head.0", 0.0, (-0.06, 0.06, 0.17))
    flap = [base, beside(base, -0.07, -0.03, 0.17), beside(base, -0.1, -0.16, 0.3)]
    body.limb(
        "flap",
        "head.0",
        flap,
        (0.15, 0.24, 0.16),
        mirrored=True,
        flat=(0.9, 0.0, 0.45),
        ratio=0.17,
        softness=0.15,
    )
    tusk = body.at("head.0", 0.9, (0.02, -0.06, 0.1))
    body.limb(
        "tusk",
        "head.0",
        [tusk, beside(tusk, 0.12, -0.14, 0.05), beside(tusk, 0.28, -0.15, 0.06)],
        (0.042, 0.036, 0.026),
        mirrored=True,
        rigid=True,
        softness=0.15,
    )
    body.curl("trunk", Z, -45, 110)
    body.curl("trunk", X, -60, 60)
    body.move("flap.0", Y, -25, 20)
    return body.skeleton(heading=10)


SPECIES = {
    "horse": horse,
    "cow": cow,
    "giraffe": giraffe,
    "camel": camel,
    "pig": pig,
    "elephant": elephant,
}
