"""Creatures: deformable shapes of our own, for the demo, the tests and for training.

A species is a skeleton with flesh on it (`species`, written with `builder`). The flesh becomes one
smooth closed surface (`implicit`, `relaxation`, `slivers`), which follows the bones (`skinning`).
`individual` puts this together. `uneven` meshes a creature as unevenly as real files are.
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
