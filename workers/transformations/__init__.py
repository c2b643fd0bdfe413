"""The transformations that a shape is to be found again after, each at five strengths.

Eleven are those of the paper's Fig. 2 and Table 1; affine, view and scan go beyond it. One
file a family: `bending`, `welding`, `cutting`, `scaling`, `resampling`, `noise`, `visibility`,
`scanning`, and `mixture` for all at once; `strengths` is the table of what each strength does.
"""

from workers.transformations.strengths import PAPER_TRANSFORMATIONS, STRENGTHS
from workers.transformations.transform import (
    TRANSFORMATION_VERSION,
    TRANSFORMATIONS,
    transform,
)
from workers.transformations.transformed import TransformedMesh

__all__ = [
    "PAPER_TRANSFORMATIONS",
    "STRENGTHS",
    "TRANSFORMATIONS",
    "TRANSFORMATION_VERSION",
    "TransformedMesh",
    "transform",
]
