"""Formats of brain surfaces: FreeSurfer, GIFTI, BrainVISA and MNI."""

from workers.geometry.formats.brains.brainvisa import is_brainvisa, read_brainvisa
from workers.geometry.formats.brains.freesurfer import is_freesurfer, read_freesurfer
from workers.geometry.formats.brains.freesurfer_text import (
    is_freesurfer_text,
    looks_like_freesurfer_text,
    read_freesurfer_text,
)
from workers.geometry.formats.brains.gifti import is_gifti, read_gifti
from workers.geometry.formats.brains.mni import is_mni, read_mni

__all__ = [
    "is_brainvisa",
    "is_freesurfer",
    "is_freesurfer_text",
    "is_gifti",
    "is_mni",
    "looks_like_freesurfer_text",
    "read_brainvisa",
    "read_freesurfer",
    "read_freesurfer_text",
    "read_gifti",
    "read_mni",
]
