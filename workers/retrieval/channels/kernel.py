"""What all channels of a kernel have in common."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workers.diffusion.kernels import Kernel, kernel_from_json, kernel_to_json
from workers.retrieval.channels.base import Channel


@dataclass(frozen=True, kw_only=True)
class KernelChannel(Channel):
    """A channel of a kernel.

    Attributes
    ----------
    kernel : Kernel
        Takes eigenvalues in the unit of the normalisation.
    """

    kernel: Kernel

    def to_json(self) -> dict[str, Any]:
        """As it is stored, with its kernel.

        Returns
        -------
        dict
        """
        return super().to_json() | {"kernel": kernel_to_json(self.kernel)}

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return super()._fields_from_json(value) | {"kernel": kernel_from_json(value["kernel"])}
