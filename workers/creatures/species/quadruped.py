"""The build that four-legged animals share, with many proportions."""

from dataclasses import dataclass

import numpy as np

from workers.creatures.builder import Point, SkeletonBuilder, X, Y, Z

Pair = tuple[float, float]


@dataclass(frozen=True)
class Build:
    """Proportions of a four-legged animal that faces +x; lengths in the species' own unit.

    ``length`` is from hip to shoulder, ``height`` from the ground to the spine. ``girth`` holds the
    radii of rump, belly and chest, ``narrow`` their width as a share of their height. ``neck`` and
    ``head`` have a length, an angle above the horizontal in degrees, and two radii each. ``ear``
    has a length and a half width. ``tail`` has a length, an angle, a bend and two radii.
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
    neck_bend: float = -12.0


def quadruped(rng: np.random.Generator, build: Build) -> SkeletonBuilder:
    """A body with root, spine, neck, head, ear, foreleg, hindleg and tail.

    Parameters
    ----------
    rng : np.random.Generator
        Draws how far the individual differs from the species.
    build : Build
        Proportions of the species.

    Returns
    -------
    SkeletonBuilder
        A skeleton under construction, to which a species adds what is its own.
    """
    length, height = build.length, build.height
    body = SkeletonBuilder(rng, (-length / 2, height, 0.0))
    length, height = body.vary(length, 0.1), body.vary(height, 0.08)
    rump, belly, chest = build.girth
    back = [(-length / 2, height, 0), (-length / 6, height - 0.12 * belly, 0)]
    back += [(length / 6, height - 0.15 * belly, 0), (length / 2, height, 0)]
    body.limb("spine", "root", back, (rump, belly, belly, chest), flat=Z, ratio=build.narrow)
    body.limb(
        "neck",
        "spine.2",
        arc(
            (length / 2, height + 0.25 * chest, 0),
            body.vary(build.neck[0], 0.12),
            build.neck[1],
            build.neck_bend,
            3,
        ),
        np.linspace(*build.neck_radii, 4).tolist(),
        flat=Z,
        ratio=0.8,
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
        "ear",
        "head.0",
        [base, tip],
        (width, 0.6 * width),
        mirrored=True,
        flat=X,
        ratio=0.6,
        softness=0.2,
    )
    _legs(body, build, length, height)
    drop = arc(
        (-length / 2 - 0.6 * rump, height + 0.4 * rump, 0),
        body.vary(build.tail[0], 0.15),
        180 - build.tail[1],
        build.tail[2],
        5,
    )
    body.limb("tail", "root", drop, np.linspace(*build.tail_radii, 6).tolist())
    _motions(body)
    return body


def arc(start: Point, length: float, angle: float, bend: float, count: int) -> list[list[float]]:
    """Points of an arc in the plane of symmetry.

    Parameters
    ----------
    start : (3,) float
        First point.
    length : float
        Of the whole arc.
    angle : float
        Heading at the start, in degrees above +x.
    bend : float
        How far the heading turns along the arc, in degrees.
    count : int
        Number of segments.

    Returns
    -------
    list of count + 1 points of 3 float
    """
    points = [[float(number) for number in start]]
    for i in range(count):
        heading = np.radians(angle + bend * (i + 0.5) / count)
        x, y, z = points[-1]
        step = length / count
        points.append([x + step * float(np.cos(heading)), y + step * float(np.sin(heading)), z])
    return points


def _legs(body: SkeletonBuilder, build: Build, length: float, height: float) -> None:
    """Add legs of three bones and a paw, feet on the ground."""
    thigh, knee, shank, foot = build.leg
    stance, paw = body.vary(build.stance, 0.08), build.paw
    low = height - 0.3 * build.girth[1]
    x = length / 2
    body.limb(
        "foreleg",
        "spine.2",
        [
            (x, low, stance),
            (x - 0.06 * low, 0.55 * low, stance),
            (x, 0.26 * low, stance),
            (x - 0.01, foot, stance),
        ],
        (thigh, knee, shank, foot),
        mirrored=True,
    )
    body.limb(
        "hindleg",
        "root",
        [
            (-x, low, stance),
            (-x + 0.08 * low, 0.55 * low, stance),
            (-x - 0.12 * low, 0.29 * low, stance),
            (-x - 0.08 * low, foot, stance),
        ],
        (1.15 * thigh, 1.1 * knee, shank, foot),
        mirrored=True,
    )
    for leg in ("foreleg", "hindleg"):
        toe = body.at(f"{leg}.2", 1.0, (0.5 * paw, -0.15 * foot, 0))
        half = (0.82 * foot + 0.6 * paw, 0.8 * foot, 0.9 * foot)
        body.blob(f"{leg}.2", toe, half, mirrored=True, power=3)


def _motions(body: SkeletonBuilder) -> None:
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
