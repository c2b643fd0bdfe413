"""The figure of all species, twice each: at rest and in a pose."""

from collections.abc import Sequence

import numpy as np

from workers.creatures.individual import SPECIES, make_creature
from workers.rendering.render import Picture, contact_sheet, render


def draw_species(
    species: Sequence[str] = SPECIES, *, size: int = 160, columns: int = 6, seed: int = 0
) -> Picture:
    """Contact sheet of species with their names, each at rest and posed.

    Parameters
    ----------
    species : sequence of str
        Which, in this order.
    size : int
        Pixels of one drawing; each species takes two.
    columns : int
        Species in a row.
    seed : int
        Of the individuals and their poses.

    Returns
    -------
    (height, width, 3) uint8
    """
    cells = []
    for name in species:
        creature = make_creature(name, seed=seed)
        pair = [render(mesh, size=size) for mesh in (creature.rest, creature.posed(seed))]
        cells.append(np.concatenate(pair, axis=1))  # (size, 2 size, 4)
    return contact_sheet(cells, columns=columns, labels=species)
