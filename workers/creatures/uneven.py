"""Creatures meshed as people's files are: few large triangles where it is flat, many small ones."""

from workers.creatures.individual import MOST_VERTICES, Creature, make_creature
from workers.geometry.mesh import TriangleMesh
from workers.transformations.resampling import decimated

# Both as measured by `python -m benchmarks.triangles` (decision 0012).
FINER = 4  # times as many vertices, before they are collapsed
BY_ERROR = 3.0  # how fast the error allowed grows: slowly, so that the smallest errors go first


def make_uneven_creature(species: str, *, seed: int, vertices: int = 4000) -> Creature:
    """The individual of `make_creature`, meshed unevenly; the same arguments give the same bytes.

    A finer one is simplified by quadric error. Its edges then vary by 0.5 to 0.9 of their mean, as
    in meshes drawn by hand (0.4 to 0.8). Those of an even creature vary by 0.2. The middle triangle
    is 2.4 times as long as one of equal sides (decision 12, ``benchmarks.triangles``). Poses share
    faces.

    Parameters
    ----------
    species : str
        One of `SPECIES`.
    seed : int
        At least 0; decides on the proportions.
    vertices : int
        About how many the surface has.

    Returns
    -------
    Creature
        At rest, with all that is needed to pose it.

    Raises
    ------
    InvalidRequestError
        As `make_creature` does.
    """
    fine = make_creature(species, seed=seed, vertices=min(FINER * vertices, MOST_VERTICES))
    n_faces = round(fine.rest.n_faces * vertices / fine.rest.n_vertices)
    found = decimated(fine.rest, n_faces, aggressiveness=BY_ERROR)
    return Creature(
        species,
        seed,
        TriangleMesh(fine.rest.vertices[found.origin], found.mesh.faces),
        fine.skeleton,
        fine.weights[found.origin],
    )
