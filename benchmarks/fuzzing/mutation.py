"""Changes within compressed files: unpacked, changed and packed again, so that they still open."""

import bz2
import gzip
import io
import lzma
import random
import zipfile
import zlib
from collections.abc import Callable

Mutate = Callable[[bytes, int], bytes]
WITHIN = 0.8
"""Share of the changes to a compressed file that go to what it holds."""
STREAMS: dict[bytes, tuple[Callable[[bytes], bytes], Callable[[bytes], bytes]]] = {
    b"\x1f\x8b": (lambda data: zlib.decompressobj(31).decompress(data, 1 << 16), gzip.compress),
    b"BZh": (lambda data: bz2.BZ2Decompressor().decompress(data, 1 << 16), bz2.compress),
    b"\xfd7zXZ": (lambda data: lzma.LZMADecompressor().decompress(data, 1 << 16), lzma.compress),
}
UNPACKING = (OSError, EOFError, ValueError, RuntimeError, NotImplementedError, LookupError)
DAMAGED = (*UNPACKING, zlib.error, lzma.LZMAError, zipfile.BadZipFile)


def mutated(data: bytes, longest: int, seed: int, mutate: Mutate) -> bytes:
    """Return a file with a change by libFuzzer, most often within what it holds.

    Parameters
    ----------
    data : bytes
    longest : int
        Bytes that it may have.
    seed : int
    mutate : function
        Changes bytes, and is told how many there may be.
    """
    rng = random.Random(seed)
    if rng.random() < WITHIN:
        try:
            changed = _within(data, longest, rng, mutate)
        except DAMAGED:
            changed = None
        if changed is not None and len(changed) <= longest:
            return changed
    return mutate(data, longest)


def _within(data: bytes, longest: int, rng: random.Random, mutate: Mutate) -> bytes | None:
    """Return a compressed file with a change in what it holds, None for other files."""
    for magic, (unpack, pack) in STREAMS.items():
        if data.startswith(magic) and unpack(data):
            return pack(mutated(unpack(data), longest, rng.randrange(1 << 30), mutate))
    if data.startswith(b"PK\x03\x04"):
        return _within_zip(data, longest, rng, mutate)
    return None


def _within_zip(data: bytes, longest: int, rng: random.Random, mutate: Mutate) -> bytes:
    """Change one entry of an archive, now and then its name."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = [(info.filename, archive.read(info)[: 1 << 16]) for info in archive.infolist()]
    chosen = rng.randrange(len(entries))
    name, content = entries[chosen]
    if rng.random() < 0.1:
        name = mutate(name.encode(), 64).decode(errors="ignore").replace("\0", "") or "a"
    else:
        content = mutated(content, longest, rng.randrange(1 << 30), mutate)
    entries[chosen] = name, content
    file = io.BytesIO()
    packing = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(file, "w", packing) as archive:
        for name, content in entries:
            archive.writestr(name, content)
    return file.getvalue()
