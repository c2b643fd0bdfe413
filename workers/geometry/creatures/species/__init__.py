"""The species: each is a function from a random generator to the skeleton of an individual."""

from collections.abc import Callable, Mapping

import numpy as np

from workers.geometry.creatures.skeleton import Skeleton
from workers.geometry.creatures.species import (
    bipeds,
    birds,
    fish,
    insects,
    quadrupeds,
    reptiles,
    softbodies,
    things,
)

Builder = Callable[[np.random.Generator], Skeleton]

BUILDERS: Mapping[str, Builder] = {
    **bipeds.SPECIES,
    **quadrupeds.SPECIES,
    **birds.SPECIES,
    **reptiles.SPECIES,
    **fish.SPECIES,
    **insects.SPECIES,
    **softbodies.SPECIES,
    **things.SPECIES,
}
