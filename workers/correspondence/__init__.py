"""Which point of one shape is which point of another: dense correspondence.

Landmarks are matched by what the surface looks like around them and made consistent by distances
along the surface (`windows`, `handedness`, `landmarks`). A functional map is fitted to them and
refined (`functional_map`), for a part with fewer functions than for the whole. The map becomes
points on faces (`precise`), with stretch and bending (`fields`) and a `confidence`. `matching` puts
it together, and `carrying` takes the result from working meshes to those that people look at.
"""

from workers.correspondence.carrying import carry
from workers.correspondence.matching import (
    CORRESPONDENCES_VERSION,
    Correspondence,
    correspond,
)

__all__ = ["CORRESPONDENCES_VERSION", "Correspondence", "carry", "correspond"]
