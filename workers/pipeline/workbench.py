"""What every verb works with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from workers.pipeline.progress import Progress
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part


@dataclass(frozen=True)
class Workbench:
    """Rows, blobs, settings, how to wake workers for parts, and who is told of each step."""

    database: Database
    blobs: BlobStore
    settings: Settings
    send: Callable[[Sequence[Part]], None]
    progress: Progress = field(default_factory=Progress)
