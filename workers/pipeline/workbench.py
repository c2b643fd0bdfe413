"""What every verb works with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part


@dataclass(frozen=True)
class Workbench:
    """Rows, blobs, settings, and how to wake workers for parts that were committed."""

    database: Database
    blobs: BlobStore
    settings: Settings
    send: Callable[[Sequence[Part]], None]
