"""The figure of all transformations of one shape, like the paper's Fig. 2."""

from workers.geometry.mesh import TriangleMesh
from workers.rendering.render import Picture, contact_sheet, render
from workers.transformations.transform import TRANSFORMATIONS, transform


def draw_transformations(
    mesh: TriangleMesh,
    *,
    pose: TriangleMesh | None = None,
    strength: int = 5,
    seed: int = 0,
    size: int = 192,
    columns: int = 5,
) -> Picture:
    """Contact sheet of a shape, "null", and of all its transformations.

    Each fills its cell, whatever its size.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean; +y is up.
    pose : TriangleMesh, optional
        What "isometry" and "all" show; the others are drawn of the shape as it is.
    strength : int
        1 to 5.
    seed : int
        Of the transformations.
    size : int
        Pixels of one drawing.
    columns : int
        Drawings in a row.

    Returns
    -------
    (height, width, 3) uint8
        Red, green and blue.
    """
    posed = ("isometry", "all")
    shown = [mesh] + [
        transform(mesh, name, strength, seed=seed, pose=pose if name in posed else None).mesh
        for name in TRANSFORMATIONS
    ]
    pictures = [render(one, size=size) for one in shown]
    return contact_sheet(pictures, columns=columns, labels=["null", *TRANSFORMATIONS])
