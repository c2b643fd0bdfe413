"""The species: each is a function from a random generator to the skeleton of an individual."""

from collections.abc import Callable, Mapping

import numpy as np

from workers.creatures.skeleton import Skeleton
from workers.creatures.species import (
    arachnids,
    bipeds,
    birds,
    cephalopods,
    fish,
    furniture,
    hands,
    hoofed,
    insects,
    leapers,
    machines,
    pawed,
    plants,
    reptiles,
    serpents,
)

Builder = Callable[[np.random.Generator], Skeleton]

BUILDERS: Mapping[str, Builder] = {
    **bipeds.SPECIES,
    **hoofed.SPECIES,
    **pawed.SPECIES,
    **birds.SPECIES,
    **reptiles.SPECIES,
    **leapers.SPECIES,
    **fish.SPECIES,
    **insects.SPECIES,
    **arachnids.SPECIES,
    **cephalopods.SPECIES,
    **serpents.SPECIES,
    **hands.SPECIES,
    **plants.SPECIES,
    **furniture.SPECIES,
    **machines.SPECIES,
}
