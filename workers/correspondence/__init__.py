"""Which point of one shape is which point of another: dense correspondence.

Which shape is a part of which, and how alike their points are, comes from windows of signatures
(`likeness`, `sides`). Matches become landmarks by distances along the surface (`handedness`,
`landmarks`). A functional map is fitted to each set of them, for a part with fewer functions than
for the whole, and the best is chosen (`hypotheses`, `functional_map`). The map becomes points on
faces (`precise`), with stretch and bending (`fields`) and a `confidence`. `matching` puts it
together, and `carrying` takes the result from working meshes to those that people look at.
"""

from workers.correspondence.carrying import carry
from workers.correspondence.matching import (
    CORRESPONDENCES_VERSION,
    Correspondence,
    correspond,
)

__all__ = ["CORRESPONDENCES_VERSION", "Correspondence", "carry", "correspond"]
