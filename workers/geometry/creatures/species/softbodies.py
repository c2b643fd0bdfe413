"""Creatures without bones: octopus, squid, starfish, snake and worm."""

import numpy as np

from workers.geometry.creatures.builder import Body, X, Y, Z
from workers.geometry.creatures.skeleton import Skeleton


def octopus(rng: np.random.Generator) -> Skeleton:
    """A bulb of a head with two eyes over eight arms."""
    body = Body(rng, (0.0, 0.5, 0.0))
    head, reach = body.vary(0.24, 0.1), body.vary(0.95, 0.1)
    body.limb("mantle", "root", [(0, 0.48, 0), (-0.06, 0.66, 0), (-0.14, 0.9, 0)], (0.15, 0.17, head))
    body.blob("mantle.0", (0.1, 0.6, 0.11), (0.07, 0.07, 0.06), mirrored=True)
    for number, angle in enumerate((20, 66, 114, 160)):
        turn = np.radians(angle)
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        points = []
        for i in range(8):
            share = i / 7
            height = 0.46 - 0.4 * np.sin(min(1.0, 1.5 * share) * np.pi / 2) + 0.14 * max(0.0, share - 0.66) * 3
            points.append((0.07 + reach * share) * out + np.array([0.0, height, 0.0]))
        name = f"arm{number}"
        body.limb(name, "root", points, np.linspace(0.088, 0.032, 8).tolist(), mirrored=True, softness=0.2)
        body.curl(name, Y, -80, 80)
        body.curl(name, (float(-out[2]), 0.0, float(out[0])), -50, 40)
        body.wave(name, Y, 12, 1.0)
    body.curl("mantle", Z, -30, 20)
    body.curl("mantle", X, -25, 25)
    return body.skeleton(heading=75)


def squid(rng: np.random.Generator) -> Skeleton:
    """A pointed mantle with two fins, eight short arms and two long tentacles."""
    body = Body(rng, (0.0, 0.0, 0.0))
    long, wide = body.vary(0.8, 0.1), body.vary(0.17, 0.1)
    points = [(0, 0, 0), (0.3 * long, 0, 0), (0.65 * long, 0, 0), (long, 0, 0)]
    body.limb("mantle", "root", points, (0.95 * wide, wide, 0.72 * wide, 0.035))
    body.limb("fin", "mantle.2", [(0.68 * long, 0, 0.05), (0.66 * long, 0, 0.22), (0.56 * long, 0, 0.34)], (0.19, 0.12, 0.034), mirrored=True,
              flat=Y, ratio=0.16, softness=0.2)
    body.limb("head", "root", [(0, 0, 0), (-0.2, 0, 0)], (0.11, 0.12), softness=0.15)
    body.blob("head.0", (-0.18, 0.02, 0.11), (0.06, 0.06, 0.045), mirrored=True)
    for number, angle in enumerate((70, 20, -30, -75)):
        turn = np.radians(angle)
        out = np.array([0.0, np.sin(turn), np.cos(turn)])
        spread, count = body.vary(0.15, 0.1), 5
        arm = [np.array([-0.24 - 0.42 * i / count, 0, 0]) + (0.075 + spread * (i / count)) * out for i in range(count + 1)]
        name = f"arm{number}"
        body.limb(name, "head.0", arm, np.linspace(0.048, 0.024, count + 1).tolist(), mirrored=True, softness=0.12)
        for axis in (Y, Z):
            body.curl(name, axis, -35, 35)
    tip = body.vary(0.95, 0.1)
    points = [(-0.24 - tip * i / 7, -0.02, 0.1 + 0.28 * i / 7) for i in range(8)]
    body.limb("tentacle", "head.0", points, (0.03, 0.027, 0.026, 0.026, 0.026, 0.026, 0.045, 0.03), mirrored=True, softness=0.12)
    for axis in (Y, Z):
        body.curl("tentacle", axis, -45, 45)
    body.wave("tentacle", Y, 14, 1.0)
    body.curl("mantle", Y, -18, 18)
    body.curl("mantle", Z, -18, 18)
    body.curl("fin", X, -45, 45)
    return body.skeleton(heading=-12)


def starfish(rng: np.random.Generator) -> Skeleton:
    """Five tapering arms in a plane that faces the viewer."""
    body = Body(rng, (0.0, 0.0, 0.0))
    body.blob("root", (0, 0, 0), (0.15, 0.25, 0.25))
    reach, thick = body.vary(0.72, 0.12), body.vary(0.18, 0.14)
    for number in range(5):
        turn = np.radians(90 + 72 * number)
        out = np.array([0.0, np.sin(turn), np.cos(turn)])
        own = body.vary(reach, 0.06)
        points = [(0.08 + own * i / 5) * out for i in range(6)]
        body.limb(f"arm{number}", "root", points, np.linspace(thick, 0.052, 6).tolist(), flat=X, ratio=0.62)
        body.curl(f"arm{number}", X, -55, 55)
        across = np.cross(out, [1.0, 0.0, 0.0])
        body.curl(f"arm{number}", across.tolist(), -50, 50)
    return body.skeleton(heading=62)


def snake(rng: np.random.Generator) -> Skeleton:
    """A long body in bends, the head raised."""
    body = Body(rng, (0.0, 0.07, 0.0))
    long, swing = body.vary(2.3, 0.1), body.vary(0.2, 0.25)
    count = 20
    shares = np.linspace(0.0, 1.0, count + 1)
    xs = (0.5 - shares) * long * 0.75
    zs = swing * np.sin(shares * 2.4 * 2 * np.pi) * np.minimum(1.0, 4.0 * shares)
    lift = 0.38 * np.clip(1.0 - shares / 0.2, 0.0, 1.0) ** 1.2
    points = np.stack([xs, 0.07 + lift, zs], axis=1)
    radii = np.interp(shares, [0, 0.08, 0.35, 0.65, 1.0], [0.055, 0.058, 0.075, 0.068, 0.022])
    half = count // 2
    body.limb("rear", "root", points[half:].tolist(), radii[half:].tolist(), jitter=0.03)
    body.limb("front", "root", points[: half + 1][::-1].tolist(), radii[: half + 1][::-1].tolist(), jitter=0.03)
    nose = points[0] + [0.03, 0.03, 0]
    body.limb("head", f"front.{half - 1}", [nose, nose + [0.15, -0.02, 0]], (0.085, 0.052), flat=Y, ratio=0.68)
    for part in ("rear", "front"):
        body.curl(part, Y, -70, 70)
        body.wave(part, Y, 20, 1.0)
        body.curl(part, Z, -14, 14)
    body.move("head.0", Y, -30, 30)
    return body.skeleton(heading=6)


def worm(rng: np.random.Generator) -> Skeleton:
    """An earthworm: a thick tube of rings with a saddle, blunt at both ends."""
    body = Body(rng, (0.0, 0.1, 0.0))
    long, thick = body.vary(1.25, 0.12), body.vary(0.092, 0.1)
    count = 14
    shares = np.linspace(-0.5, 0.5, count + 1)
    hump = body.vary(0.3, 0.2)
    points = np.stack([-long * shares, 0.1 + hump * np.exp(-((shares / 0.17) ** 2)), 0.07 * np.sin(7 * shares)], axis=1)
    radii = thick * np.interp(np.abs(shares), [0, 0.4, 0.5], [1.0, 0.95, 0.7])
    half = count // 2
    body.limb("rear", "root", points[half:].tolist(), radii[half:].tolist(), jitter=0.02)
    body.limb("front", "root", points[: half + 1][::-1].tolist(), radii[: half + 1][::-1].tolist(), jitter=0.02)
    for part in ("rear", "front"):
        for i in range(half):
            for share in (0.0, 0.5):
                saddle = part == "front" and i in (3, 4)
                ring = (1.26 if saddle else 1.09) * thick * (0.9 if i == half - 1 else 1.0)
                way = body.at(f"{part}.{i}", 1.0) - body.at(f"{part}.{i}")
                pitch, yaw = np.degrees(np.arctan2(way[1], np.hypot(way[0], way[2]))), np.degrees(np.arctan2(-way[2], way[0]))
                body.blob(f"{part}.{i}", body.at(f"{part}.{i}", share), (0.6 * thick if saddle else 0.38 * thick, ring, ring), pitch=float(pitch), yaw=float(-yaw),
                          softness=0.12, jitter=0.02)
        body.curl(part, Y, -110, 110)
        body.curl(part, Z, -40, 40)
        body.wave(part, Y, 14, 1.0)
    return body.skeleton(heading=0)


SPECIES = {"octopus": octopus, "squid": squid, "starfish": starfish, "snake": snake, "worm": worm}
