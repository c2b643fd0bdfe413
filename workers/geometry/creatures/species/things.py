"""What does not walk: a hand, plants and furniture."""

import numpy as np

from workers.geometry.creatures.builder import Body, X, Y, Z
from workers.geometry.creatures.skeleton import Skeleton


def hand(rng: np.random.Generator) -> Skeleton:
    """A right hand with the fingers spread, and its wrist."""
    body = Body(rng, (0.0, 0.0, 0.0))
    length, thick = body.vary(1.0, 0.1), body.vary(1.0, 0.1)
    body.limb("wrist", "root", [(0, 0.05, 0), (0, -0.2, 0), (0, -0.42, 0)], (0.17, 0.15, 0.155), flat=X, ratio=0.78)
    body.blob("root", (0, 0.24, 0), (0.115, 0.3, 0.27), power=3)
    fingers = (("index", 0.22, 0.5, 0.34, 13), ("middle", 0.075, 0.53, 0.38, 4), ("ring", -0.075, 0.52, 0.355, -5), ("little", -0.21, 0.45, 0.28, -15))
    for name, across, base, reach, spread in fingers:
        turn = np.radians(spread)
        out = np.array([0.02, np.cos(turn), np.sin(turn)])
        start = np.array([0.0, base, across])
        reach = body.vary(reach, 0.05) * length
        points = [start - 0.22 * out, start] + [start + reach * share * out for share in (0.48, 0.78, 1.02)]
        radii = [thick * radius for radius in (0.085, 0.075, 0.066, 0.06, 0.05)]
        body.limb(name, "root", points, radii, softness=0.15)
        bones = [f"{name}.{i}" for i in (1, 2, 3)]
        body.move(bones, Z, -85, 6, shares=(0.8, 1.0, 0.6))
        body.move(f"{name}.1", X, -5, 5)
    thumb = [(0.04, 0.1, 0.18), (0.1, 0.26, 0.35), (0.11, 0.42, 0.47), (0.11, 0.55, 0.54)]
    body.limb("thumb", "root", thumb, [thick * radius for radius in (0.105, 0.085, 0.072, 0.056)], softness=0.2)
    body.move(["thumb.0", "thumb.1", "thumb.2"], (0.1, 0.6, 0.5), -40, 15, shares=(0.5, 0.6, 0.5))
    body.curl("wrist", Z, -25, 25)
    body.curl("wrist", X, -15, 15)
    return body.skeleton(heading=72)


def tree(rng: np.random.Generator) -> Skeleton:
    """A trunk with roots, and boughs that carry clumps of leaves."""
    body = Body(rng, (0.0, 0.0, 0.0))
    tall = body.vary(0.62, 0.12)
    body.limb("trunk", "root", [(0, 0, 0), (0.02, 0.5 * tall, 0), (0, tall, 0.01), (0.01, 1.35 * tall, 0)], (0.13, 0.1, 0.09, 0.075), softness=0.25)
    for number in range(5):
        turn = np.radians(72 * number + 20)
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        body.limb(f"foot{number}", "root", [(0, 0.04, 0), (0.24 * out + [0, 0.0, 0]).tolist()], (0.09, 0.035), rigid=True)
    body.blob("trunk.2", (0.01, 1.35 * tall + 0.24, 0), (0.27, 0.24, 0.27))
    for number in range(5):
        turn = np.radians(72 * number + body.vary(30, 0.3))
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        start = np.array([0.0, tall * (0.8 + 0.05 * (number % 3)), 0.0])
        end = start + body.vary(0.52, 0.1) * out + [0, body.vary(0.2, 0.3), 0]
        bend = (start + end) / 2 + [0, -0.04, 0]
        body.limb(f"bough{number}", "trunk.1", [start, bend, end], (0.07, 0.055, 0.05))
        clump = body.vary(0.19, 0.15)
        body.blob(f"bough{number}.1", end + 0.05 * out, (clump, 0.85 * clump, clump))
        body.curl(f"bough{number}", Y, -14, 14)
        body.curl(f"bough{number}", np.cross(out, Y).tolist(), -22, 18)
    body.curl("trunk", X, -18, 18)
    body.curl("trunk", Z, -18, 18)
    return body.skeleton()


def cactus(rng: np.random.Generator) -> Skeleton:
    """A column with arms that turn upwards."""
    body = Body(rng, (0.0, 0.0, 0.0))
    tall, thick = body.vary(1.3, 0.1), body.vary(0.15, 0.1)
    points = [(0, tall * i / 6, 0) for i in range(7)]
    body.limb("column", "root", points, [thick * share for share in (0.9, 1, 1.05, 1.05, 1.05, 1, 0.9)], softness=0.2)
    arms = (("first", 1.0, 0.36, 0.55), ("second", -1.0, 0.52, 0.4))
    for name, side, share, rise in arms:
        low, reach = tall * body.vary(share, 0.12), side * body.vary(0.4, 0.1)
        up = body.vary(rise, 0.15)
        arm = [(0, low, 0), (0, low, 0.6 * reach), (0, low + 0.07, reach), (0, low + 0.5 * up, 1.08 * reach), (0, low + up, 1.08 * reach)]
        body.limb(name, "column.2" if share < 0.5 else "column.3", arm, [thick * k for k in (0.6, 0.62, 0.66, 0.68, 0.6)], softness=0.2)
        body.curl(name, X, -35, 35)
        body.curl(name, Y, -35, 35)
    arm = [(0, 0.66 * tall, 0), (0.2, 0.67 * tall, 0.06), (0.29, 0.75 * tall, 0.08), (0.3, 0.92 * tall, 0.08)]
    body.limb("third", "column.4", arm, [thick * k for k in (0.5, 0.52, 0.54, 0.48)], softness=0.2)
    body.curl("column", X, -28, 28)
    body.curl("column", Z, -28, 28)
    return body.skeleton(heading=85)


def _legs(body: Body, *, x: float, z: float, top: float, radius: float) -> None:
    """Four legs under a board, each of two bones."""
    for name, sign in (("foreleg", 1.0), ("hindleg", -1.0)):
        points = [(sign * x, top, z), (sign * 1.04 * x, 0.5 * top, 1.04 * z), (sign * 1.08 * x, radius, 1.08 * z)]
        body.limb(name, "root", points, (1.1 * radius, radius, 0.9 * radius), mirrored=True, softness=0.15)
        body.move(f"{name}.0", Z, -14, 14)
        body.move(f"{name}.0", X, -14, 14)
        body.move(f"{name}.1", Z, -22, 22)
        body.move(f"{name}.1", X, -22, 22)


def chair(rng: np.random.Generator) -> Skeleton:
    """A seat on four legs, and a back."""
    body = Body(rng, (0.0, 0.46, 0.0))
    deep, wide, high = body.vary(0.25, 0.1), body.vary(0.25, 0.12), body.vary(0.52, 0.14)
    body.blob("root", (0, 0.48, 0), (deep, 0.04, wide), power=8, softness=0.15)
    _legs(body, x=deep - 0.05, z=wide - 0.05, top=0.46, radius=0.034)
    body.limb("back", "root", [(-deep + 0.03, 0.48, 0), (-deep + 0.02, 0.48 + 0.5 * high, 0), (-deep - 0.02, 0.48 + high, 0)], (0.034, 0.034, 0.034))
    for i in range(2):
        for share in (0.25, 0.75):
            place = body.at(f"back.{i}", share)
            body.blob(f"back.{i}", place, (0.036, 0.17 * high, wide), power=8, softness=0.1, jitter=0.0)
    body.move(["back.0", "back.1"], Z, -18, 35, shares=(0.6, 0.6))
    body.move(["back.0", "back.1"], Y, -18, 18, shares=(0.5, 0.5))
    return body.skeleton(heading=60)


def table(rng: np.random.Generator) -> Skeleton:
    """A board on four legs."""
    body = Body(rng, (0.0, 0.66, 0.0))
    long, wide = body.vary(0.62, 0.15), body.vary(0.38, 0.15)
    body.limb("left", "root", [(0, 0.7, 0), (-long, 0.7, 0)], (0.036, 0.036))
    body.limb("right", "root", [(0, 0.7, 0), (long, 0.7, 0)], (0.036, 0.036))
    body.blob("root", (0, 0.7, 0), (long, 0.042, wide), power=8, softness=0.15)
    _legs(body, x=long - 0.08, z=wide - 0.08, top=0.68, radius=0.044)
    return body.skeleton(heading=20)


def lamp(rng: np.random.Generator) -> Skeleton:
    """A desk lamp: a round foot, two arms with joints, a shade."""
    body = Body(rng, (0.0, 0.05, 0.0))
    lower, upper = body.vary(0.55, 0.1), body.vary(0.5, 0.1)
    body.blob("root", (0, 0.05, 0), (0.25, 0.06, 0.25), power=3, softness=0.15)
    elbow = np.array([-0.2, 0.08 + lower, 0])
    wrist = elbow + upper * np.array([0.75, 0.5, 0])
    body.limb("arm", "root", [(0, 0.06, 0), elbow, wrist], (0.042, 0.042, 0.042), softness=0.15)
    body.blob("arm.1", elbow, (0.065, 0.065, 0.055), softness=0.15)
    down = np.array([0.6, -0.8, 0])
    body.limb("shade", "arm.1", [wrist, wrist + 0.1 * down, wrist + 0.3 * down], (0.075, 0.09, 0.2), softness=0.15)
    body.move("arm.0", Z, -30, 25)
    body.move("arm.1", Z, -35, 40)
    body.move("arm.0", Y, -45, 45)
    body.move("shade.0", Z, -35, 45)
    body.move("shade.0", Y, -35, 35)
    return body.skeleton(heading=5)


SPECIES = {"hand": hand, "tree": tree, "cactus": cactus, "chair": chair, "table": table, "lamp": lamp}
