"""What lies beside meshes in folders and archives, told by name."""

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from types import MappingProxyType

SYSTEM = "system file"
_ENDINGS = {
    "picture": "png jpg jpeg jpe jfif bmp tga tif tiff webp gif dds exr hdr pic ktx ktx2 basis svg "
    "ico heic heif psd xcf kra avif jp2 eps",
    "text": "txt md rst nfo csv tsv json json5 xml yaml yml toml ini cfg conf log html htm css js "
    "py sh bat tex bib license lic readme",
    "document": "pdf doc docx odt rtf xls xlsx ods ppt pptx odp epub pages numbers",
    "material file": "mtl mat sbsar mdl",
    "G-code file": "gcode gco gcode3 g nc ngc cnc tap bgcode x3g makerbot",
    "link": "url webloc lnk desktop",
    "video": "mp4 mov avi webm mkv mpg mpeg wmv m4v",
    "sound": "mp3 wav ogg flac aac m4a",
    "table": "vert cor map lmk landmarks",
    "program": "exe dll so dylib msi jar apk",
    "font": "ttf otf woff woff2",
}
_BINARY_BUFFER = "buffer"
NEVER: Mapping[str, str] = MappingProxyType(
    {ending: kind for kind, endings in _ENDINGS.items() for ending in endings.split()}
)
"""Endings of files that are no meshes, and what they are. Their content is not looked at where
pictures and texts stand beside meshes: a text may read like an OBJ file by accident."""

_TEXTS = (
    "license licence copying readme notice authors contributors changelog changes credits "
    "copyright attribution makefile todo"
)
_NAMES: Mapping[str, str] = MappingProxyType(dict.fromkeys(_TEXTS.split(), "text"))
_SYSTEM_NAMES = frozenset({"thumbs.db", "desktop.ini", "icon\r", "ehthumbs.db"})
_SEEN: Mapping[str, str] = MappingProxyType({"bin": _BINARY_BUFFER, "scad": "OpenSCAD source"})
_SUMMED = frozenset({*_ENDINGS, *_SEEN.values(), SYSTEM, "file"})


def ending_of(path: str) -> str:
    """Return the ending of a file's name, in lower case and without the dot.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    str
        Empty where there is none.
    """
    return PurePosixPath(path).suffix[1:].lower()


def system_file(path: str) -> bool:
    """Whether a file is hidden, or something that systems leave behind.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    bool
        True also for what lies in a hidden folder.
    """
    parts = [part for part in path.split("/") if part not in {"", ".", ".."}]
    hidden = any(part.startswith(".") or part == "__MACOSX" for part in parts)
    return hidden or bool(parts and parts[-1].lower() in _SYSTEM_NAMES)


def kind_by_name(path: str) -> str | None:
    """Say what a file is that is never a mesh, by its name alone.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    str or None
        "picture", "text" and so on; None where the content decides.
    """
    name = PurePosixPath(path).name.lower()
    if "." not in name.strip("."):
        return _NAMES.get(name)
    return NEVER.get(ending_of(path))


def kind_if_no_mesh(path: str) -> str:
    """Say in short what a file is whose content is no mesh.

    Parameters
    ----------
    path : str
        With ``/`` between names.

    Returns
    -------
    str
        "file" where nothing more is known.
    """
    return _SEEN.get(ending_of(path), "file")


def summarise(details: Iterable[str]) -> str:
    """Count skipped files by what they are: "8 pictures, 3 texts, 1 other".

    Parameters
    ----------
    details : iterable of str
        What each is.

    Returns
    -------
    str
        The most frequent first; whole sentences count as others.
    """
    counts = Counter(detail if detail in _SUMMED else "other" for detail in details)
    counts["other"] += counts.pop("file", 0)
    named = [(kind, count) for kind, count in counts.most_common() if kind != "other"]
    parts = [f"{count} {kind}{'' if count == 1 else 's'}" for kind, count in named]
    if others := counts["other"]:
        kind = "other" if named else "file"
        parts.append(f"{others} {kind}{'' if others == 1 else 's'}")
    return ", ".join(parts)
