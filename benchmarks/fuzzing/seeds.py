"""What fuzzing starts from: small files of every kind that the tests build, and their words."""

import hashlib
import io
import re
import zipfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from benchmarks.kinds import kinds_of
from tests.meshes import icosphere
from workers.errors import ProteusError
from workers.geometry.formats import WRITTEN_FORMATS, detect_format, write

ANY = "any"
"""Files of every format together: what detection and containers are fuzzed with."""
LARGEST_SEED = 1 << 14
SMALL_BODY = icosphere(0)
WORD = re.compile(rb"[A-Za-z_:/<>!?.=\"-]{3,32}")
WORDS = 500


def seeds() -> Mapping[str, list[bytes]]:
    """Return small files by format, those of every kind that the tests know.

    The builders run with a body of 20 faces. A builder that cannot is left out. Files with Draco
    are apart: they are decoded in another process, which takes long.
    """
    found: defaultdict[str, dict[str, bytes]] = defaultdict(dict)
    files = [(write(SMALL_BODY, form), f"a.{form}") for form in WRITTEN_FORMATS]
    files += [(data, kind.filename) for kind, data in kinds_of(SMALL_BODY)]
    for data, filename in files:
        if len(data) > LARGEST_SEED:
            continue
        key = hashlib.sha256(data).hexdigest()[:16]
        found[ANY][key] = data
        try:
            form = detect_format(data, filename)
            found[f"{form}-draco" if b"draco" in data else form][key] = data
        except ProteusError:
            continue
    return {form: list(one.values()) for form, one in found.items()}


def dictionary(files: list[bytes]) -> str:
    """Return the words of files as a dictionary of libFuzzer."""
    words: dict[bytes, None] = {}
    for data in files:
        for part in _parts(data):
            words.update(dict.fromkeys(WORD.findall(part[:4096])))
    chosen = list(words)[:WORDS]
    return "".join(f'"{_escaped(word)}"\n' for word in chosen)


def _parts(data: bytes) -> list[bytes]:
    """Return what a zip archive holds, or the file itself."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return [archive.read(name) for name in archive.namelist()]
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError):
        return [data]


def _escaped(word: bytes) -> str:
    return "".join(chr(c) if chr(c) not in '"\\' else f"\\x{c:02x}" for c in word)


def write_seeds(files: list[bytes], folder: Path) -> None:
    """Write files under names of their content, as libFuzzer does."""
    folder.mkdir(parents=True, exist_ok=True)
    for data in files:
        (folder / hashlib.sha256(data).hexdigest()[:24]).write_bytes(data)
