"""Creatures on six, eight or ten legs."""

from collections.abc import Sequence

import numpy as np

from workers.geometry.creatures.builder import Body, X, Y, Z
from workers.geometry.creatures.skeleton import Skeleton


def _legs(
    body: Body, places: Sequence[tuple[float, float]], *, parent: str, start: tuple[float, float], reach: float,
    rise: float, radius: float, ground: float = 0.03,
) -> None:
    """Pairs of legs: each at an x, towards an angle (degrees forwards of sideways).

    They leave the body at (height, half width), rise to a knee and come down to the ground.
    """
    height, wide = start
    reach = body.vary(reach, 0.1)
    for number, (x, angle) in enumerate(places):
        out = np.array([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
        hip = np.array([x, height, wide])
        knee = hip + 0.42 * reach * out + np.array([0.0, rise, 0.0])
        shin = hip + 0.8 * reach * out
        shin[1] = 0.42 * knee[1] + 0.58 * ground
        foot = hip + reach * out
        foot[1] = ground
        name = f"leg{number}"
        body.limb(name, parent, [hip, knee, shin, foot], (1.25 * radius, 1.1 * radius, radius, 0.9 * radius),
                  mirrored=True, softness=0.2)
        body.move(f"{name}.0", Y, -20, 20)
        body.move(f"{name}.0", X, -14, 12)
        body.move(f"{name}.1", (float(out[2]), 0.0, float(-out[0])), -16, 22)


def ant(rng: np.random.Generator) -> Skeleton:
    """Head, thorax and abdomen like beads, six legs, elbowed feelers."""
    body = Body(rng, (0.0, 0.3, 0.0))
    body.limb("spine", "root", [(0.16, 0.3, 0), (-0.02, 0.32, 0), (-0.2, 0.29, 0)], (0.085, 0.09, 0.05), softness=0.15)
    gaster = body.vary(0.25, 0.12)
    body.limb("waist", "spine.1", [(-0.18, 0.29, 0), (-0.3, 0.32, 0)], (0.045, 0.05), softness=0.15)
    body.blob("waist.0", (-0.32 - gaster, 0.34, 0), (gaster, 0.165, 0.165), pitch=-6, softness=0.15)
    head = body.vary(0.13, 0.1)
    body.limb("neck", "root", [(0.16, 0.3, 0), (0.3, 0.32, 0)], (0.05, 0.05), softness=0.15)
    body.blob("neck.0", (0.3 + head, 0.33, 0), (1.25 * head, 0.95 * head, 1.15 * head), pitch=-15, softness=0.15)
    front = 0.3 + 2.1 * head
    body.limb("jaw", "neck.0", [(front - 0.04, 0.26, 0.07), (front + 0.09, 0.22, 0.035)], (0.035, 0.026), mirrored=True, softness=0.15)
    body.limb("feeler", "neck.0", [(front - 0.06, 0.4, 0.06), (front + 0.08, 0.56, 0.16), (front + 0.26, 0.46, 0.22)],
              (0.027, 0.026, 0.026), mirrored=True, softness=0.15)
    _legs(body, ((0.12, 38), (0.0, 2), (-0.12, -36)), parent="root", start=(0.28, 0.06), reach=0.58, rise=0.2, radius=0.03)
    body.move("waist.0", Z, -25, 20)
    body.move("waist.0", Y, -25, 25)
    body.move("neck.0", Y, -30, 30)
    body.move("neck.0", Z, -20, 20)
    body.move("feeler.0", Y, -25, 20)
    body.move("feeler.1", Y, -30, 30)
    return body.skeleton(heading=14)


def beetle(rng: np.random.Generator) -> Skeleton:
    """A dome of wing cases, a shield, a head with a great horn, six legs."""
    body = Body(rng, (0.0, 0.25, 0.0))
    long, wide = body.vary(0.42, 0.1), body.vary(0.31, 0.1)
    body.blob("root", (-0.12, 0.26, 0), (long, 0.225, wide), softness=0.12)
    body.limb("chest", "root", [(0.16, 0.25, 0), (0.36, 0.24, 0)], (0.16, 0.15), softness=0.1)
    body.blob("chest.0", (0.34, 0.25, 0), (0.15, 0.17, 0.23), softness=0.1)
    body.limb("head", "chest.0", [(0.45, 0.2, 0), (0.56, 0.18, 0)], (0.11, 0.1), softness=0.12)
    horn = [(0.6, 0.2, 0), (0.78, 0.26, 0), (0.86, 0.42, 0), (0.8, 0.56, 0)]
    body.limb("horn", "head.0", horn, (0.06, 0.048, 0.042, 0.034), rigid=True, softness=0.15)
    _legs(body, ((0.3, 42), (0.05, -4), (-0.2, -38)), parent="root", start=(0.15, 0.17), reach=0.46, rise=0.1, radius=0.034)
    body.move("chest.0", Y, -14, 14)
    body.move("chest.0", Z, -12, 12)
    body.move("head.0", Z, -30, 25)
    body.move("head.0", Y, -25, 25)
    return body.skeleton(heading=16)


def spider(rng: np.random.Generator) -> Skeleton:
    """Two beads and eight long arched legs."""
    body = Body(rng, (0.0, 0.32, 0.0))
    rear = body.vary(0.25, 0.14)
    body.blob("root", (0.06, 0.32, 0), (0.17, 0.11, 0.145), softness=0.15)
    body.limb("waist", "root", [(-0.08, 0.32, 0), (-0.16, 0.35, 0)], (0.055, 0.06), softness=0.15)
    body.blob("waist.0", (-0.18 - 0.8 * rear, 0.38, 0), (rear, 0.78 * rear, 0.85 * rear), pitch=-8, softness=0.15)
    body.limb("palp", "root", [(0.2, 0.31, 0.05), (0.3, 0.3, 0.08), (0.34, 0.22, 0.07)], (0.034, 0.032, 0.03), mirrored=True, softness=0.15)
    places = ((0.16, 58), (0.1, 22), (0.03, -18), (-0.04, -55))
    _legs(body, places, parent="root", start=(0.31, 0.1), reach=0.88, rise=0.34, radius=0.032)
    body.move("waist.0", Z, -20, 20)
    body.move("waist.0", Y, -20, 20)
    body.move("palp.0", Y, -15, 15)
    return body.skeleton(heading=25)


def scorpion(rng: np.random.Generator) -> Skeleton:
    """Claws held forwards, eight legs, a tail arched over the back with a sting."""
    body = Body(rng, (0.0, 0.2, 0.0))
    body.limb("spine", "root", [(0.24, 0.2, 0), (0.0, 0.21, 0), (-0.3, 0.22, 0)], (0.13, 0.16, 0.1), flat=Y, ratio=0.65)
    tail, scale = [(-0.3, 0.22, 0)], body.vary(0.16, 0.1)
    for angle in (165, 135, 100, 62, 25, -15):
        x, y, z = tail[-1]
        tail.append((x + scale * float(np.cos(np.radians(angle))), y + scale * float(np.sin(np.radians(angle))), z))
    body.limb("tail", "spine.1", tail, (0.07, 0.062, 0.06, 0.056, 0.054, 0.052, 0.05), softness=0.2)
    x, y, _ = tail[-1]
    body.blob("tail.5", (x + 0.01, y, 0), (0.085, 0.07, 0.065), pitch=-30, softness=0.2)
    body.limb("sting", "tail.5", [(x + 0.04, y - 0.03, 0), (x + 0.13, y - 0.13, 0)], (0.04, 0.025), rigid=True)
    claw = body.vary(1.0, 0.14)
    arm = [(0.28, 0.2, 0.09), (0.42, 0.22, 0.26), (0.62, 0.2, 0.28)]
    body.limb("arm", "root", arm, (0.045, 0.042, 0.045), mirrored=True, softness=0.2)
    body.limb("palm", "arm.1", [(0.62, 0.2, 0.28), (0.62 + 0.13 * claw, 0.2, 0.26)], (0.06 * claw, 0.078 * claw), mirrored=True, softness=0.2)
    base = body.at("palm.0", 1.0)
    body.limb("finger", "palm.0", [base + [0.03, 0, 0.05], base + [0.15 * claw, 0, 0.065], base + [0.25 * claw, 0, 0.02]],
              (0.04, 0.034, 0.026), mirrored=True, rigid=True, softness=0.1)
    body.limb("pincer", "palm.0", [base + [0.03, 0, -0.05], base + [0.13 * claw, 0, -0.075], base + [0.22 * claw, 0, -0.055]],
              (0.036, 0.032, 0.026), mirrored=True, softness=0.1)
    _legs(body, ((0.16, 35), (0.06, 10), (-0.05, -15), (-0.16, -40)), parent="root", start=(0.18, 0.1), reach=0.46, rise=0.12, radius=0.029)
    body.curl("tail", Z, -60, 50)
    body.curl("tail", X, -50, 50)
    body.curl("spine", Y, -20, 20)
    body.move("arm.0", Y, -20, 18)
    body.move("arm.1", Y, -25, 20)
    body.move("arm.0", Z, -5, 15)
    return body.skeleton(heading=18)


def crab(rng: np.random.Generator) -> Skeleton:
    """A broad shell, eight legs to the sides, two raised claws, eyes on stalks."""
    body = Body(rng, (0.0, 0.26, 0.0))
    wide = body.vary(0.36, 0.1)
    body.blob("root", (0, 0.28, 0), (0.25, 0.13, wide), softness=0.15)
    body.limb("eye", "root", [(0.2, 0.34, 0.09), (0.25, 0.45, 0.1)], (0.03, 0.036), mirrored=True, softness=0.15)
    arm = [(0.18, 0.26, 0.22), (0.34, 0.28, 0.4), (0.5, 0.4, 0.34)]
    body.limb("arm", "root", arm, (0.055, 0.055, 0.055), mirrored=True, softness=0.2)
    claw = body.vary(1.0, 0.15)
    base = np.array(arm[-1])
    body.limb("palm", "arm.1", [base, base + np.array([0.06, 0.09, -0.04]) * claw], (0.07 * claw, 0.1 * claw), mirrored=True, softness=0.2)
    top = body.at("palm.0", 1.0)
    body.limb("finger", "palm.0", [top + [0.02, 0.05, 0.06], top + [0.05, 0.16 * claw, 0.075], top + [0.06, 0.25 * claw, 0.02]],
              (0.045, 0.042, 0.027), mirrored=True, rigid=True, softness=0.1)
    body.limb("pincer", "palm.0", [top + [0.03, 0.04, -0.06], top + [0.06, 0.14 * claw, -0.09], top + [0.07, 0.21 * claw, -0.06]],
              (0.04, 0.038, 0.026), mirrored=True, softness=0.1)
    _legs(body, ((0.08, 22), (0.0, 2), (-0.08, -18), (-0.16, -40)), parent="root", start=(0.25, 0.26), reach=0.56, rise=0.16, radius=0.035)
    body.move("arm.0", Y, -22, 18)
    body.move("arm.0", X, -20, 15)
    body.move("arm.1", Z, -15, 25)
    body.move("pincer.0", X, -12, 12)
    body.move("eye.0", Z, -25, 25)
    return body.skeleton(heading=58)


SPECIES = {"ant": ant, "beetle": beetle, "spider": spider, "scorpion": scorpion, "crab": crab}
