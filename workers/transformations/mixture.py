"""All transformations at once, each weaker than alone."""

from collections.abc import Callable, Mapping

import numpy as np

from workers.geometry.mesh import TriangleMesh
from workers.transformations.cutting import punch_holes
from workers.transformations.noise import add_noise, add_shots
from workers.transformations.resampling import resample
from workers.transformations.scaling import scale, scale_locally
from workers.transformations.transformed import TransformedMesh
from workers.transformations.welding import weld


def mix(
    posed: TransformedMesh, levels: Mapping[str, float], rng: np.random.Generator
) -> TransformedMesh:
    """Weld, scale locally, punch holes, add shots and noise, resample and scale a posed mesh.

    Parameters
    ----------
    posed : TransformedMesh
        The shape in its pose.
    levels : mapping of str to float
        The row "all" of the table of strengths.
    rng : Generator
        Of all of them.

    Returns
    -------
    TransformedMesh
        With origins in the mesh that was posed.
    """
    steps: list[Callable[[TriangleMesh], TransformedMesh]] = [
        lambda mesh: weld(
            mesh,
            fewest=int(levels["fewest welds"]),
            most=int(levels["most welds"]),
            gap=levels["widest gap, √A"],
            rng=rng,
        ),
        lambda mesh: scale_locally(
            mesh,
            factor=levels["largest local factor or its inverse"],
            places=int(levels["places"]),
            rng=rng,
        ),
        lambda mesh: punch_holes(
            mesh, area_left=levels["area left by holes"], discs=int(levels["discs"]), rng=rng
        ),
        lambda mesh: add_shots(
            mesh,
            share=levels["vertices displaced"],
            farthest=levels["farthest displacement, √A"],
            rng=rng,
        ),
        lambda mesh: add_noise(mesh, growth=levels["growth of area"], rng=rng),
        lambda mesh: resample(mesh, share=levels["faces left"]),
        lambda mesh: scale(mesh, factor=levels["factor or its inverse"], rng=rng),
    ]
    for step in steps:
        posed = posed.then(step(posed.mesh))
    return posed
