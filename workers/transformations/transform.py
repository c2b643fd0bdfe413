"""The one entrance: a transformation by name, strength and seed."""

import hashlib
from collections.abc import Callable, Mapping

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.mesh import TriangleMesh
from workers.transformations.bending import bend
from workers.transformations.cutting import cut, punch_holes, punch_micro_holes
from workers.transformations.mixture import mix
from workers.transformations.noise import add_noise, add_shots
from workers.transformations.resampling import resample
from workers.transformations.scaling import scale, scale_affinely, scale_locally
from workers.transformations.scanning import Scanner, scan
from workers.transformations.strengths import STRENGTHS, TABLE, settings
from workers.transformations.transformed import TransformedMesh, moved
from workers.transformations.visibility import see
from workers.transformations.welding import weld

TRANSFORMATION_VERSION = "1"
"""Raised when the same arguments give another mesh than before."""

TRANSFORMATIONS = tuple(TABLE)

_Action = Callable[[TriangleMesh, Mapping[str, float], np.random.Generator], TransformedMesh]


def transform(
    mesh: TriangleMesh,
    transformation: str,
    strength: int,
    *,
    seed: int,
    pose: TriangleMesh | None = None,
) -> TransformedMesh:
    """A deformed mesh that knows which vertex of the given one each of its vertices was.

    The same arguments give the same result.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no degenerate face; of any unit and topology.
    transformation : str
        One of `TRANSFORMATIONS`.
    strength : int
        1 to 5; `strengths.TABLE` says what each means.
    seed : int
        At least 0.
    pose : TriangleMesh, optional
        The shape in another pose, in the same vertex order. Transformations happen on top of it,
        and it is the result of "isometry", which bends the mesh at random without it.

    Returns
    -------
    TransformedMesh

    Raises
    ------
    InvalidRequestError
        The transformation is unknown, the strength or the seed out of range, or the pose has
        another number of vertices.
    """
    if transformation not in TABLE:
        raise InvalidRequestError(
            f"the transformation {transformation!r} is unknown, "
            f"expected one of {', '.join(TRANSFORMATIONS)}"
        )
    if strength not in STRENGTHS:
        raise InvalidRequestError(f"the strength is {strength!r}, expected 1 to 5")
    if seed < 0:
        raise InvalidRequestError(f"the seed is {seed}, at least 0 is expected")
    if pose is not None and pose.n_vertices != mesh.n_vertices:
        raise InvalidRequestError(
            f"the pose has {pose.n_vertices} vertices, expected {mesh.n_vertices} as the mesh has"
        )
    rng = _generator(transformation, strength, seed)
    levels = settings(transformation, strength)
    if transformation in _BENDING:
        posed = moved(pose, pose.vertices) if pose is not None else _bend(mesh, levels, rng)
        return posed if transformation == "isometry" else mix(posed, levels, rng)
    base = mesh if pose is None else pose
    return _ACTIONS[transformation](base, levels, rng)


def _generator(transformation: str, strength: int, seed: int) -> np.random.Generator:
    """A stream of random numbers of its own for every transformation, strength and seed."""
    name = hashlib.sha256(f"{transformation}/{strength}".encode()).digest()[:8]
    return np.random.default_rng([int.from_bytes(name, "little"), seed])


def _bend(
    mesh: TriangleMesh, levels: Mapping[str, float], rng: np.random.Generator
) -> TransformedMesh:
    """Bend a shape that has no poses."""
    return bend(mesh, degrees=levels["largest rotation, degrees"], rng=rng)


_BENDING = ("isometry", "all")

_ACTIONS: Mapping[str, _Action] = {
    "topology": lambda mesh, levels, rng: weld(
        mesh,
        fewest=int(levels["fewest welds"]),
        most=int(levels["most welds"]),
        gap=levels["widest gap, √A"],
        rng=rng,
    ),
    "holes": lambda mesh, levels, rng: punch_holes(
        mesh, area_left=levels["area left"], discs=int(levels["discs"]), rng=rng
    ),
    "micro-holes": lambda mesh, levels, rng: punch_micro_holes(
        mesh, area_left=levels["area left"], rng=rng
    ),
    "scale": lambda mesh, levels, rng: scale(mesh, factor=levels["factor or its inverse"], rng=rng),
    "local-scale": lambda mesh, levels, rng: scale_locally(
        mesh,
        factor=levels["largest local factor or its inverse"],
        places=int(levels["places"]),
        rng=rng,
    ),
    "sampling": lambda mesh, levels, rng: resample(mesh, share=levels["faces left"]),
    "noise": lambda mesh, levels, rng: add_noise(mesh, growth=levels["growth of area"], rng=rng),
    "shot-noise": lambda mesh, levels, rng: add_shots(
        mesh,
        share=levels["vertices displaced"],
        farthest=levels["farthest displacement, √A"],
        rng=rng,
    ),
    "partial": lambda mesh, levels, rng: cut(mesh, area_left=levels["area left"], rng=rng),
    "affine": lambda mesh, levels, rng: scale_affinely(
        mesh, ratio=levels["longest over shortest axis"], rng=rng
    ),
    "view": lambda mesh, levels, rng: see(
        mesh,
        rank=levels["rank of the direction"],
        grazing_degrees=levels["most grazing angle, degrees"],
        rng=rng,
    ),
    "scan": lambda mesh, levels, rng: scan(
        mesh,
        Scanner(
            samples=int(levels["samples"]),
            grazing_degrees=levels["most grazing angle, degrees"],
            rim_loss=levels["rim pixels lost"],
            noise=levels["noise along the ray, √A"],
            quantum=levels["step of depth, √A"],
        ),
        rank=levels["rank of the direction"],
        rng=rng,
    ),
}
