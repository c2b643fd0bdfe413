"""Formats of science by what the content begins with."""

from collections.abc import Callable

from workers.geometry.formats.amf.package import is_amf
from workers.geometry.formats.brains import (
    is_brainvisa,
    is_freesurfer,
    is_freesurfer_text,
    is_gifti,
    is_mni,
    looks_like_freesurfer_text,
)
from workers.geometry.formats.collada import is_collada
from workers.geometry.formats.msh import is_medit, is_msh
from workers.geometry.formats.vtk import is_legacy_vtk, is_vtk_xml

SIGNS: tuple[tuple[Callable[[bytes], bool], str], ...] = (
    (is_amf, "amf"),
    (is_collada, "dae"),
    (is_legacy_vtk, "vtk"),
    (is_vtk_xml, "vtp"),
    (is_freesurfer, "freesurfer"),
    (is_freesurfer_text, "freesurfer-text"),
    (is_gifti, "gifti"),
    (is_mni, "mni"),
    (is_brainvisa, "brainvisa"),
    (is_msh, "msh"),
    (is_medit, "medit"),
)
"""Of formats that begin with a sign of their own."""


def by_sign(data: bytes) -> str | None:
    """Find the format whose sign the content begins with.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    str or None
        A name of `detect_format`.
    """
    return next((name for sign, name in SIGNS if sign(data)), None)


def by_sign_of_text(data: bytes, filename: str) -> str | None:
    """Find the format of a text that begins with plain numbers, by its ending.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Such as "lh.pial.asc".

    Returns
    -------
    str or None
        A name of `detect_format`.
    """
    ending = filename.rpartition(".")[2].lower()
    is_surface = ending in ("asc", "srf") and looks_like_freesurfer_text(data)
    return "freesurfer-text" if is_surface else None
