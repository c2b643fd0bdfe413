"""Creatures: deformable shapes of our own, for the demo, the tests and for training.

A species is written down as a skeleton with flesh on it (`species`), which becomes one smooth
closed surface (`implicit`, `relaxation`) that follows its bones (`skinning`); `individual`
puts this together, and `uneven` meshes it as people's files are.
"""

from workers.creatures.individual import (
    CREATURES_VERSION,
    SPECIES,
    TESTED_SPECIES,
    TRAINING_SPECIES,
    Creature,
    make_creature,
)
from workers.creatures.uneven import make_uneven_creature

__all__ = [
    "CREATURES_VERSION",
    "SPECIES",
    "TESTED_SPECIES",
    "TRAINING_SPECIES",
    "Creature",
    "make_creature",
    "make_uneven_creature",
]
