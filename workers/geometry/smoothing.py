"""Implicit smoothing: the surface after one backward step of its own heat flow."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from workers.errors import InvalidRequestError
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh

FEWEST_VERTICES = 4  # nothing with fewer encloses anything


def smooth(mesh: TriangleMesh, *, time: float) -> TriangleMesh:
    """Vertices (A + t·|S|·W)⁻¹ A V: each coordinate after heat has flowed for t·|S| (Desbrun 1999).

    Noise, whose wavelength is short, goes; what is longer than about √t of the surface stays. The
    result does not depend on the unit, position or orientation of the mesh.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no zero-area face, no unreferenced vertex.
    time : float
        t >= 0, as a share of the surface area |S|; 1e-4 takes noise away and leaves limbs.

    Returns
    -------
    TriangleMesh
        The same faces; the mesh itself where t is 0.

    Raises
    ------
    InvalidRequestError
        The time is negative or not finite.
    InvalidMeshError
        A face has no area.
    """
    if not (np.isfinite(time) and time >= 0.0):
        raise InvalidRequestError(f"smoothing time is {time}, expected a finite number from 0")
    if time == 0.0 or mesh.n_vertices < FEWEST_VERTICES:
        return mesh
    centre = mesh.vertices.mean(axis=0)
    length = np.sqrt(mesh.area)
    unit = TriangleMesh((mesh.vertices - centre) / length, mesh.faces)
    laplacian = mesh_laplacian(unit)
    mass = sparse.diags_array(laplacian.areas, format="csc")
    step = splu(
        sparse.csc_matrix(mass + time * laplacian.stiffness),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    moved = step.solve(laplacian.areas[:, None] * unit.vertices)  # (n, 3)
    return TriangleMesh(centre + length * moved, mesh.faces)
