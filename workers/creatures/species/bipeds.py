"""Creatures with two arms and two legs."""

from dataclasses import dataclass

import numpy as np

from workers.creatures.builder import SkeletonBuilder, X, Y, Z
from workers.creatures.skeleton import Skeleton
from workers.geometry.arrays import FloatArray


@dataclass(frozen=True)
class Build:
    """Proportions of an upright body that faces +x; lengths in metres or so.

    ``leg`` is the height of the hip, ``torso`` from hip to shoulder, ``arm`` from shoulder to
    wrist; ``shoulder`` and ``hip`` are half widths; ``girth`` and ``limb`` are factors.
    """

    leg: float = 0.88
    torso: float = 0.5
    arm: float = 0.55
    shoulder: float = 0.19
    hip: float = 0.1
    head: float = 0.115
    neck: float = 0.12
    girth: float = 1.0
    limb: float = 1.0
    hand: float = 0.085


def upright(rng: np.random.Generator, build: Build) -> SkeletonBuilder:
    """A body with root, spine, neck, head, arm and leg.

    Parameters
    ----------
    rng : np.random.Generator
        Draws how far the individual differs from the species.
    build : Build
        Proportions of the species.

    Returns
    -------
    SkeletonBuilder
        A skeleton under construction, facing +x.
    """
    leg, torso = _vary(rng, build.leg, 0.07), _vary(rng, build.torso, 0.07)
    girth, thick = _vary(rng, build.girth, 0.14), _vary(rng, build.limb, 0.12)
    body = SkeletonBuilder(rng, (0.0, leg, 0.0))
    up = np.array([0.0, 1.0, 0.0])
    base = np.array([0.0, leg, 0.0])
    spine = [base + share * torso * up for share in (0.0, 0.35, 0.72, 0.98)]
    body.limb(
        "spine",
        "root",
        spine,
        [girth * radius for radius in (0.16, 0.14, 0.17, 0.12)],
        flat=X,
        ratio=0.68,
    )
    top = base + torso * up
    crown = top + build.neck * up
    body.limb("neck", "spine.2", [top, crown], (0.065 * girth, 0.055 * girth))
    head = body.vary(build.head, 0.07)
    face = crown + head * np.array([0.15, 0.75, 0.0])
    body.limb("head", "neck.0", [crown, face], (0.5 * head, 0.6 * head))
    body.blob("head.0", face, (0.92 * head, 1.12 * head, 0.78 * head))
    chin = face + head * np.array([0.3, -0.7, 0.0])
    body.blob("head.0", chin, (0.45 * head, 0.4 * head, 0.42 * head))
    _arms(body, build, top, thick)
    _legs(body, build, leg, thick)
    _motions(body)
    return body


def _vary(rng: np.random.Generator, value: float, spread: float) -> float:
    return float(value * (1.0 + spread * rng.uniform(-1.0, 1.0)))


def _arms(body: SkeletonBuilder, build: Build, top: FloatArray, thick: float) -> None:
    """Add arms held away from the body, with a mitten and a thumb."""
    arm, wide = body.vary(build.arm, 0.07), body.vary(build.shoulder, 0.08)
    shoulder = top + np.array([0.0, -0.05, wide])
    elbow = shoulder + 0.5 * arm * np.array([-0.03, -0.72, 0.69])
    wrist = elbow + 0.5 * arm * np.array([0.2, -0.78, 0.6])
    ahead = np.array([0.2, -0.78, 0.6])
    knuckle, tip = wrist + build.hand * ahead, wrist + 2 * build.hand * ahead
    body.limb(
        "arm",
        "spine.2",
        [shoulder, elbow, wrist],
        (0.072 * thick, 0.05 * thick, 0.038 * thick),
        mirrored=True,
    )
    body.limb(
        "hand",
        "arm.1",
        [wrist, knuckle, tip],
        (0.036, 0.5 * build.hand, 0.34 * build.hand),
        mirrored=True,
        flat=(0.3, 0.6, 0.75),
        ratio=0.6,
    )
    body.limb(
        "thumb",
        "hand.0",
        [wrist + 0.3 * build.hand * ahead, wrist + build.hand * (ahead + np.array([0.75, 0.1, 0]))],
        (0.022, 0.02),
        mirrored=True,
        rigid=True,
    )


def _legs(body: SkeletonBuilder, build: Build, leg: float, thick: float) -> None:
    """Add legs a little apart, with feet on the ground."""
    hip = body.vary(build.hip, 0.08)
    knee, ankle = (-0.0, 0.53 * leg, hip + 0.11 * leg), (-0.03, 0.075, hip + 0.17 * leg)
    calf = (-0.035, 0.4 * leg, hip + 0.125 * leg)
    body.limb(
        "leg",
        "root",
        [(0, leg - 0.01, hip), knee, ankle],
        (0.098 * thick, 0.062 * thick, 0.042 * thick),
        mirrored=True,
    )
    body.blob("leg.1", calf, (0.05 * thick, 0.12 * leg, 0.05 * thick), mirrored=True)
    out = hip + 0.17 * leg
    body.limb(
        "foot",
        "leg.1",
        [(-0.04, 0.045, out), (0.16, 0.035, out + 0.03)],
        (0.045, 0.042),
        mirrored=True,
        flat=Y,
        ratio=0.8,
    )


def _motions(body: SkeletonBuilder) -> None:
    """Let the body walk, reach, bow and turn."""
    body.curl("spine", Z, -38, 14)
    body.curl("spine", Y, -28, 28)
    body.curl("spine", X, -16, 16)
    body.move(["neck.0", "head.0"], Y, -40, 40, shares=(0.5, 0.5))
    body.move(["neck.0", "head.0"], Z, -25, 20, shares=(0.5, 0.5))
    body.move("arm.0", X, -60, 30)
    body.move("arm.0", Y, -45, 45)
    body.move("arm.0", Z, -35, 60)
    body.move("arm.1", (0.2, 0.55, 0.8), 0, 80)
    body.curl("hand", (1.0, 0.0, 0.0), -10, 35)
    body.move("leg.0", Z, -30, 65)
    body.move("leg.0", X, -14, 5)
    body.move("leg.0", Y, -15, 15)
    body.move("leg.1", Z, -75, 0)
    body.move("foot.0", Z, -20, 15)


def human(rng: np.random.Generator) -> Skeleton:
    """A grown-up person.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    return upright(rng, Build()).skeleton(heading=80)


def child(rng: np.random.Generator) -> Skeleton:
    """Short legs and arms, a large head, a round belly.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = upright(
        rng,
        Build(
            leg=0.46,
            torso=0.34,
            arm=0.36,
            shoulder=0.125,
            hip=0.07,
            head=0.125,
            neck=0.075,
            girth=0.76,
            limb=0.78,
            hand=0.06,
        ),
    )
    body.blob("spine.0", body.at("spine.0", 0.9, (0.03, 0, 0)), (0.1, 0.11, 0.115))
    return body.skeleton(heading=80)


def ape(rng: np.random.Generator) -> Skeleton:
    """A gorilla on its knuckles: long strong arms, short bent legs, a crest, a heavy brow.

    Parameters
    ----------
    rng : np.random.Generator
        Draws the proportions of the individual.

    Returns
    -------
    Skeleton
        Bones, flesh and motions at rest: +x is forwards, +y is up, lengths in a unit of its own.
    """
    body = SkeletonBuilder(rng, (-0.34, 0.5, 0.0))
    arm, wide = body.vary(0.84, 0.12), body.vary(0.27, 0.1)
    girth = body.vary(1.0, 0.12)
    spine = [(-0.34, 0.5, 0), (-0.14, 0.64, 0), (0.06, 0.8, 0), (0.16, 0.9, 0)]
    body.limb("spine", "root", spine, [girth * k for k in (0.185, 0.21, 0.235, 0.17)])
    body.blob("spine.2", (0.06, 0.82, 0), (0.19, 0.16, wide), pitch=40)
    body.limb("neck", "spine.2", [(0.18, 0.94, 0), (0.28, 1.02, 0)], (0.15, 0.125))
    body.limb("head", "neck.0", [(0.3, 1.06, 0), (0.43, 0.97, 0)], (0.12, 0.08))
    body.blob("head.0", (0.26, 1.15, 0), (0.09, 0.1, 0.06), pitch=-25)  # crest
    body.blob("head.0", (0.38, 1.09, 0), (0.055, 0.035, 0.09), softness=0.2)  # brow
    shoulder = (0.12, 0.88, wide)
    elbow, wrist = (0.06, 0.9 - 0.48 * arm, wide + 0.13), (0.2, 0.09, wide + 0.12)
    body.limb("arm", "spine.2", [shoulder, elbow, wrist], (0.135, 0.095, 0.075), mirrored=True)
    body.limb("hand", "arm.1", [wrist, (0.26, 0.05, wide + 0.12)], (0.07, 0.065), mirrored=True)
    knee, ankle = (-0.2, 0.3, 0.24), (-0.36, 0.07, 0.26)
    body.limb("leg", "root", [(-0.34, 0.46, 0.13), knee, ankle], (0.15, 0.1, 0.07), mirrored=True)
    body.limb("foot", "leg.1", [ankle, (-0.16, 0.05, 0.3)], (0.065, 0.06), mirrored=True)
    body.curl("spine", Z, -22, 28)
    body.curl("spine", Y, -22, 22)
    body.move(["neck.0", "head.0"], Y, -45, 45, shares=(0.5, 0.5))
    body.move(["neck.0", "head.0"], Z, -25, 20, shares=(0.5, 0.5))
    body.move("arm.0", Z, -30, 50)
    body.move("arm.0", X, -35, 5)
    body.move("arm.1", Z, -10, 45)
    body.move("leg.0", Z, -30, 30)
    body.move("leg.1", Z, -20, 25)
    body.move("foot.0", Z, -15, 15)
    return body.skeleton(heading=18)


SPECIES = {
    "human": human,
    "child": child,
    "ape": ape,
}
