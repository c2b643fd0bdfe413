"""Four-legged animals: one build with many proportions, and what makes each of them itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.geometry.creatures.builder import Body, X, Y, Z
from workers.geometry.creatures.skeleton import Skeleton

Pair = tuple[float, float]


@dataclass(frozen=True)
class Build:
    """Proportions of a four-legged animal that faces +x; lengths in the species' own unit.

    ``length`` is from hip to shoulder, ``height`` from the ground to the spine; ``girth`` are the
    radii of rump, belly and chest, ``narrow`` their width as a share of their height. A ``neck`` and
    a ``head`` have a length and an angle above the horizontal in degrees, and two radii each;
    ``ear`` has a length and a half width; ``tail`` a length, an angle, a bend and two radii.
    """

    length: float
    height: float
    girth: tuple[float, float, float]
    narrow: float
    stance: float
    leg: tuple[float, float, float, float]
    paw: float
    neck: Pair
    neck_radii: Pair
    head: Pair
    head_radii: Pair
    ear: Pair
    ear_tilt: float
    tail: tuple[float, float, float]
    tail_radii: Pair


def arc(start: Sequence[float], length: float, angle: float, bend: float, count: int) -> list[list[float]]:
    """Points of an arc in the plane of symmetry: it leaves at an angle and turns by bend degrees."""
    points = [list(start)]
    for i in range(count):
        heading = np.radians(angle + bend * (i + 0.5) / count)
        x, y, z = points[-1]
        step = length / count
        points.append([x + step * float(np.cos(heading)), y + step * float(np.sin(heading)), z])
    return points


def quadruped(rng: np.random.Generator, build: Build) -> Body:
    """Body with root, spine, neck, head, ear, foreleg, hindleg and tail."""
    length, height = build.length, build.height
    body = Body(rng, (-length / 2, height, 0.0))
    length, height = body.vary(length, 0.1), body.vary(height, 0.08)
    rump, belly, chest = build.girth
    back = [(-length / 2, height, 0), (-length / 6, height - 0.12 * belly, 0)]
    back += [(length / 6, height - 0.15 * belly, 0), (length / 2, height, 0)]
    body.limb("spine", "root", back, (rump, belly, belly, chest), flat=Z, ratio=build.narrow)
    body.limb(
        "neck", "spine.2", arc((length / 2, height + 0.25 * chest, 0), body.vary(build.neck[0], 0.12),
        build.neck[1], -12, 3), np.linspace(*build.neck_radii, 4).tolist(), flat=Z, ratio=0.8,
    )
    top = body.at("neck.2", 1.0)
    reach, angle = body.vary(build.head[0], 0.1), build.head[1]
    nose = arc(top, reach, angle, 0, 2)
    skull, muzzle = build.head_radii
    body.limb("head", "neck.2", [nose[0], nose[2]], (skull, muzzle), flat=Z, ratio=0.85)
    ear, width = body.vary(build.ear[0], 0.15), build.ear[1]
    lean, side = np.radians(build.ear_tilt), 0.62 * skull
    base = top + np.array([-0.1 * skull, 0.6 * skull, side])
    tip = base + ear * np.array([-0.15, np.cos(lean), np.sin(lean)])
    body.limb(
        "ear", "head.0", [base, tip], (width, 0.6 * width), mirrored=True, flat=X, ratio=0.6, softness=0.2
    )
    _legs(body, build, length, height)
    drop = arc((-length / 2 - 0.6 * rump, height + 0.4 * rump, 0), body.vary(build.tail[0], 0.15),
               180 - build.tail[1], build.tail[2], 5)
    body.limb("tail", "root", drop, np.linspace(*build.tail_radii, 6).tolist())
    _motions(body)
    return body


def _legs(body: Body, build: Build, length: float, height: float) -> None:
    """Add legs of three bones and a paw, feet on the ground."""
    thigh, knee, shank, foot = build.leg
    stance, paw = body.vary(build.stance, 0.08), build.paw
    low = height - 0.3 * build.girth[1]
    x = length / 2
    body.limb(
        "foreleg", "spine.2",
        [(x, low, stance), (x - 0.06 * low, 0.55 * low, stance), (x, 0.26 * low, stance), (x - 0.01, foot, stance)],
        (thigh, knee, shank, foot), mirrored=True,
    )
    body.limb(
        "hindleg", "root",
        [(-x, low, stance), (-x + 0.08 * low, 0.55 * low, stance), (-x - 0.12 * low, 0.29 * low, stance),
         (-x - 0.08 * low, foot, stance)],
        (1.15 * thigh, 1.1 * knee, shank, foot), mirrored=True,
    )
    for leg in ("foreleg", "hindleg"):
        toe = body.at(f"{leg}.2", 1.0, (0.5 * paw, -0.15 * foot, 0))
        body.blob(f"{leg}.2", toe, (foot + 0.6 * paw, foot, 1.1 * foot), mirrored=True, power=2.5)


def _motions(body: Body) -> None:
    """Let the animal walk, crouch, look around and wag its tail."""
    body.curl("spine", Y, -22, 22)
    body.curl("spine", Z, -18, 18)
    body.curl("neck", Z, -30, 25)
    body.curl("neck", Y, -35, 35)
    body.move("head.0", Z, -20, 15)
    body.move("head.0", X, -12, 12)
    body.move("ear.0", X, -15, 15)
    body.move("foreleg.0", Z, -28, 32)
    body.move("foreleg.1", Z, 0, 25)
    body.move("foreleg.2", Z, -55, 0)
    body.move("hindleg.0", Z, -28, 28)
    body.move(["hindleg.0", "hindleg.1", "hindleg.2"], Z, 0, 28, shares=(0.6, -1.3, 1.0))
    body.move("foreleg.0", X, -2, 7)
    body.move("hindleg.0", X, -2, 7)
    body.curl("tail", Y, -70, 70)
    body.curl("tail", Z, -50, 30)


def horse(rng: np.random.Generator) -> Skeleton:
    """Long legs and neck, a mane, a long head and a full tail."""
    body = quadruped(rng, Build(
        length=0.86, height=1.06, girth=(0.215, 0.2, 0.215), narrow=0.72, stance=0.115,
        leg=(0.105, 0.062, 0.045, 0.042), paw=0.03, neck=(0.52, 58), neck_radii=(0.16, 0.085),
        head=(0.4, -48), head_radii=(0.098, 0.06), ear=(0.1, 0.032), ear_tilt=15,
        tail=(0.68, -20, 62), tail_radii=(0.045, 0.04)))
    for i in range(3):
        body.blob(f"neck.{i}", body.at(f"neck.{i}", 0.5, (-0.1 + 0.02 * i, 0.045, 0)), (0.1, 0.05, 0.03), pitch=55)
    for i in range(1, 5):
        body.blob(f"tail.{i}", body.at(f"tail.{i}", 0.5), (0.062, 0.1, 0.062))
    return body.skeleton(heading=8)


def dog(rng: np.random.Generator) -> Skeleton:
    """Deep chest, slim waist, a muzzle with a stop, hanging ears and a raised tail."""
    body = quadruped(rng, Build(
        length=0.62, height=0.66, girth=(0.125, 0.115, 0.155), narrow=0.78, stance=0.095,
        leg=(0.078, 0.05, 0.036, 0.036), paw=0.045, neck=(0.25, 48), neck_radii=(0.105, 0.08),
        head=(0.28, -12), head_radii=(0.1, 0.048), ear=(0.15, 0.045), ear_tilt=150,
        tail=(0.42, 45, -60), tail_radii=(0.036, 0.024)))
    body.blob("head.0", body.at("head.0", 0.95, (0, 0.02, 0)), (0.03, 0.03, 0.035))
    return body.skeleton(heading=12)


def cat(rng: np.random.Generator) -> Skeleton:
    """Long low body, round head with pointed ears, a long curved tail."""
    body = quadruped(rng, Build(
        length=0.6, height=0.47, girth=(0.12, 0.115, 0.118), narrow=0.82, stance=0.08,
        leg=(0.066, 0.045, 0.035, 0.034), paw=0.035, neck=(0.17, 45), neck_radii=(0.092, 0.08),
        head=(0.085, -12), head_radii=(0.115, 0.075), ear=(0.115, 0.055), ear_tilt=18,
        tail=(0.66, 20, -95), tail_radii=(0.034, 0.024)))
    return body.skeleton(heading=14)


def cow(rng: np.random.Generator) -> Skeleton:
    """Barrel body, short legs, horns, an udder and a broad muzzle."""
    body = quadruped(rng, Build(
        length=0.98, height=0.92, girth=(0.24, 0.265, 0.24), narrow=0.78, stance=0.15,
        leg=(0.11, 0.07, 0.052, 0.052), paw=0.03, neck=(0.34, 22), neck_radii=(0.18, 0.115),
        head=(0.31, -42), head_radii=(0.125, 0.088), ear=(0.13, 0.045), ear_tilt=82,
        tail=(0.62, -12, 78), tail_radii=(0.036, 0.03)))
    base = body.at("head.0", 0.0, (-0.02, 0.09, 0.06))
    body.limb("horn", "head.0", [base, base + [0.0, 0.09, 0.09], base + [0.05, 0.19, 0.1]],
              (0.038, 0.034, 0.024), mirrored=True, rigid=True, softness=0.15)
    body.blob("spine.0", body.at("spine.0", 0.45, (0, -0.26, 0)), (0.12, 0.085, 0.09))
    body.blob("tail.4", body.at("tail.4", 0.9), (0.045, 0.09, 0.045))
    return body.skeleton(heading=8)


def giraffe(rng: np.random.Generator) -> Skeleton:
    """A very long neck, sloping back, long legs, two knobs on the head."""
    body = quadruped(rng, Build(
        length=0.62, height=1.2, girth=(0.165, 0.185, 0.205), narrow=0.75, stance=0.105,
        leg=(0.085, 0.052, 0.04, 0.042), paw=0.025, neck=(1.1, 72), neck_radii=(0.155, 0.064),
        head=(0.26, -32), head_radii=(0.075, 0.045), ear=(0.11, 0.03), ear_tilt=72,
        tail=(0.5, -35, 48), tail_radii=(0.032, 0.028)))
    base = body.at("head.0", 0.05, (-0.01, 0.055, 0.03))
    body.limb("horn", "head.0", [base, base + [-0.02, 0.1, 0.015]], (0.024, 0.027),
              mirrored=True, rigid=True, softness=0.15)
    body.blob("tail.4", body.at("tail.4", 0.9), (0.04, 0.08, 0.04))
    return body.skeleton(heading=10)


def elephant(rng: np.random.Generator) -> Skeleton:
    """Heavy body on pillars, large flat ears, tusks and a trunk."""
    body = quadruped(rng, Build(
        length=0.82, height=1.0, girth=(0.3, 0.335, 0.3), narrow=0.82, stance=0.19,
        leg=(0.135, 0.105, 0.095, 0.098), paw=0.02, neck=(0.2, 28), neck_radii=(0.22, 0.2),
        head=(0.16, -58), head_radii=(0.205, 0.14), ear=(0.05, 0.03), ear_tilt=80,
        tail=(0.45, -40, 40), tail_radii=(0.035, 0.03)))
    trunk = arc(body.at("head.0", 0.9), body.vary(0.85, 0.1), -62, 25, 7)
    body.limb("trunk", "head.0", trunk, np.linspace(0.12, 0.046, 8).tolist())
    base = body.at("head.0", 0.0, (-0.06, 0.06, 0.17))
    flap = [base, base + [-0.07, -0.03, 0.17], base + [-0.1, -0.16, 0.3]]
    body.limb("flap", "head.0", flap, (0.13, 0.2, 0.13), mirrored=True, flat=(0.9, 0.0, 0.45),
              ratio=0.17, softness=0.15)
    tusk = body.at("head.0", 0.9, (0.02, -0.06, 0.1))
    body.limb("tusk", "head.0", [tusk, tusk + [0.12, -0.14, 0.05], tusk + [0.28, -0.15, 0.06]],
              (0.042, 0.036, 0.026), mirrored=True, rigid=True, softness=0.15)
    body.curl("trunk", Z, -45, 110)
    body.curl("trunk", X, -60, 60)
    body.move("flap.0", Y, -25, 20)
    return body.skeleton(heading=18)


def lion(rng: np.random.Generator) -> Skeleton:
    """A cat's body, large, with a mane around the head and a tuft on the tail."""
    body = quadruped(rng, Build(
        length=0.84, height=0.74, girth=(0.155, 0.155, 0.19), narrow=0.8, stance=0.12,
        leg=(0.1, 0.072, 0.056, 0.054), paw=0.06, neck=(0.26, 42), neck_radii=(0.17, 0.15),
        head=(0.24, -14), head_radii=(0.14, 0.088), ear=(0.05, 0.04), ear_tilt=30,
        tail=(0.78, -28, 18), tail_radii=(0.036, 0.03)))
    crown = body.at("neck.2", 0.6, (-0.05, -0.01, 0))
    body.blob("neck.2", crown, (0.13, 0.285, 0.235), pitch=-12, softness=0.12)
    body.blob("neck.0", body.at("neck.0", 0.6, (0.03, -0.1, 0)), (0.17, 0.25, 0.19), pitch=15)
    for side in (0.11,):
        body.blob("head.0", body.at("neck.2", 0.75, (-0.02, 0.25, side)), (0.04, 0.055, 0.055), mirrored=True)
    body.blob("tail.4", body.at("tail.4", 1.0), (0.085, 0.06, 0.06), pitch=-30)
    return body.skeleton(heading=12)


def camel(rng: np.random.Generator) -> Skeleton:
    """Two humps, long legs, a neck that dips and rises."""
    body = quadruped(rng, Build(
        length=0.86, height=1.12, girth=(0.2, 0.225, 0.22), narrow=0.75, stance=0.12,
        leg=(0.095, 0.06, 0.048, 0.055), paw=0.03, neck=(0.2, -8), neck_radii=(0.16, 0.1),
        head=(0.06, 0), head_radii=(0.09, 0.085), ear=(0.03, 0.02), ear_tilt=40,
        tail=(0.42, -25, 60), tail_radii=(0.035, 0.028)))
    return body.skeleton(heading=8)


def pig(rng: np.random.Generator) -> Skeleton:
    """A barrel on short legs, a disc for a snout, a small curly tail."""
    body = quadruped(rng, Build(
        length=0.6, height=0.46, girth=(0.2, 0.22, 0.2), narrow=0.85, stance=0.11,
        leg=(0.085, 0.06, 0.046, 0.044), paw=0.02, neck=(0.14, 12), neck_radii=(0.18, 0.165),
        head=(0.26, -16), head_radii=(0.16, 0.07), ear=(0.14, 0.06), ear_tilt=35,
        tail=(0.24, 40, -220), tail_radii=(0.03, 0.024)))
    body.blob("head.0", body.at("head.0", 1.12), (0.035, 0.078, 0.078), pitch=-16, power=3, softness=0.15)
    return body.skeleton(heading=15)


def rabbit(rng: np.random.Generator) -> Skeleton:
    """Long ears, round back, strong hind legs, a ball for a tail."""
    body = quadruped(rng, Build(
        length=0.34, height=0.33, girth=(0.17, 0.17, 0.125), narrow=0.88, stance=0.088,
        leg=(0.066, 0.046, 0.036, 0.036), paw=0.035, neck=(0.13, 55), neck_radii=(0.1, 0.085),
        head=(0.1, -18), head_radii=(0.1, 0.066), ear=(0.3, 0.045), ear_tilt=14,
        tail=(0.05, 30, 0), tail_radii=(0.06, 0.06)))
    body.blob("hindleg.0", body.at("hindleg.0", 0.4, (0.02, 0, 0.02)), (0.13, 0.12, 0.055), mirrored=True, pitch=-20)
    body.blob("hindleg.2", body.at("hindleg.2", 1.0, (0.1, 0, 0)), (0.12, 0.034, 0.04), mirrored=True)
    body.curl("ear", Z, -20, 20)
    return body.skeleton(heading=15)


SPECIES = {
    "horse": horse, "dog": dog, "cat": cat, "cow": cow, "giraffe": giraffe,
    "elephant": elephant, "lion": lion, "camel": camel, "pig": pig, "rabbit": rabbit,
}
