"""Files within files: what is compressed, and what an archive or a folder holds."""

from workers.geometry.formats.containers.clutter import summarise
from workers.geometry.formats.containers.companions import Neighbours, with_its_files
from workers.geometry.formats.containers.contents import (
    Contents,
    Found,
    Refused,
    Skipped,
    no_mesh,
)
from workers.geometry.formats.containers.judging import (
    has_archive_ending,
    has_mesh_ending,
    why_skipped,
    why_skipped_by_name,
)
from workers.geometry.formats.containers.members import Archive, ArchiveLimits, Member
from workers.geometry.formats.containers.opening import archive_kind, open_archive
from workers.geometry.formats.containers.unwrapping import is_wrapped, unwrap

__all__ = [
    "Archive",
    "ArchiveLimits",
    "Contents",
    "Found",
    "Member",
    "Neighbours",
    "Refused",
    "Skipped",
    "archive_kind",
    "has_archive_ending",
    "has_mesh_ending",
    "is_wrapped",
    "no_mesh",
    "open_archive",
    "summarise",
    "unwrap",
    "why_skipped",
    "why_skipped_by_name",
    "with_its_files",
]
