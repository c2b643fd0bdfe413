"""Which point of one shape is which point of another: dense correspondence.

Landmarks are matched by what the surface looks like around them and made consistent by distances
along the surface (`windows`, `landmarks`). A functional map is fitted to them and refined
(`functional_map`), for a part with fewer functions than for the whole. The map becomes points on
faces (`precise`), with stretch and bending as fields (`fields`). `matching` puts it together.
"""

from workers.correspondence.matching import Correspondence, correspond

__all__ = ["Correspondence", "correspond"]
