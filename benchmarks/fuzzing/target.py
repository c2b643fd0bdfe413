"""Reads what libFuzzer makes, and keeps an account. Run as a program by ``benchmarks.fuzzing``.

``python -m benchmarks.fuzzing.target READER FOLDER [options of libFuzzer]`` goes on until libFuzzer
has enough, and past what it finds; only a crash of the process or a hang ends it.
"""

import hashlib
import json
import resource
import sys
import time
import traceback
import tracemalloc
import warnings
from collections import Counter
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["workers.geometry.formats"]):
    from workers.geometry.formats import MeshLimits, parse
    from workers.geometry.formats.parsing import ParsedMesh

from benchmarks.fuzzing.mutation import mutated
from workers.errors import ProteusError
from workers.geometry.cleaning import clean

LIMITS = MeshLimits(vertices=20_000, faces=40_000, unpacked=1 << 18)
SLOWEST_SECONDS = 2.0
MEMORY_FACTOR = 20
MEMORY_FLOOR = 16 << 20
"""Bytes: `LIMITS` lets a small file unpack to more than 20 times its size, but not to this. The
dictionary of an xz stream takes 8 MB alone."""
CLEANED_FACES = 2000
SAVED_EVERY = 500
UNNAMED = "the file is damaged and cannot be read"


class Account:
    """What came of the inputs, in a folder.

    Parameters
    ----------
    reader : str
    folder : Path
        Takes ``account.json`` and the smallest input of each finding.
    """

    def __init__(self, reader: str, folder: Path) -> None:
        self.name = f"a.{reader}"
        self.folder = folder
        self.path = folder / "account.json"
        self.counts: Counter[str] = Counter()
        self.unnamed: Counter[str] = Counter()
        self.peak = 0
        self._forget_peak()

    def take(self, data: bytes) -> None:
        """Read one input and count what came of it."""
        self.counts["inputs"] += 1
        if self.counts["inputs"] % SAVED_EVERY == 0:
            self.save()
        start = time.process_time()
        try:
            self.counts[self._read(data)] += 1
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt | SystemExit):
                raise
            self.find("raised", f"{type(error).__name__} {place_of(error)}", data, error)
        seconds = time.process_time() - start
        if seconds > SLOWEST_SECONDS:
            self.find("slow", f"{seconds:.0f} s", data)
        if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 > self.peak:
            self._look_at_memory(data)

    def save(self) -> None:
        """Write the counts."""
        document = {"counts": dict(self.counts), "unnamed": dict(self.unnamed.most_common(20))}
        self.path.write_text(json.dumps(document))

    def find(
        self, kind: str, signature: str, data: bytes, error: BaseException | None = None
    ) -> None:
        """Keep the smallest input of a finding."""
        self.counts[kind] += 1
        key = hashlib.sha256(f"{kind} {signature}".encode()).hexdigest()[:10]
        path = self.folder / f"{kind}-{key}.bin"
        if path.exists() and path.stat().st_size <= len(data):
            return
        path.write_bytes(data)
        trace = "".join(traceback.format_exception(error)) if error else ""
        path.with_suffix(".txt").write_text(f"{signature}\n{trace}")

    def _read(self, data: bytes) -> str:
        try:
            parsed = parse(data, filename=self.name, limits=LIMITS)
        except ProteusError as error:
            if str(error).startswith(UNNAMED):
                self.unnamed[place_of(error.__cause__ or error)] += 1
                return "unnamed"
            return "refused"
        self._check(parsed, data)
        if parsed.mesh.n_faces > CLEANED_FACES:
            return "read"
        try:
            clean(parsed.mesh)
        except ProteusError:
            return "refused when cleaned"
        return "cleaned"

    def _check(self, parsed: ParsedMesh, data: bytes) -> None:
        """Hold a mesh against what `parse` promises."""
        mesh = parsed.mesh
        if mesh.n_faces > LIMITS.faces:
            self.find("broken", "more faces than the limit", data)
        if mesh.n_faces and not 0 <= mesh.faces.min() <= mesh.faces.max() < mesh.n_vertices:
            self.find("broken", "indices out of range", data)

    def _forget_peak(self) -> None:
        """Set the largest memory of the process back to what it has now."""
        Path("/proc/self/clear_refs").write_text("5")
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        self.peak = peak + MEMORY_FLOOR

    def _look_at_memory(self, data: bytes) -> None:
        """Read an input again with its memory traced: the process has grown on it."""
        self._forget_peak()
        taken = traced_memory(data, self.name)
        if taken > MEMORY_FACTOR * len(data) + MEMORY_FLOOR:
            self.find("memory", f"{taken >> 20} MB of {len(data) >> 10} kB", data)
        self._forget_peak()


def traced_memory(data: bytes, name: str) -> int:
    """Return the most memory that reading takes, in bytes."""
    tracemalloc.start()
    try:
        parse(data, filename=name, limits=LIMITS)
    except ProteusError:
        pass
    finally:
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return taken


def place_of(error: BaseException) -> str:
    """Return where in the package an error was raised."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if "/workers/" in frame.filename
    ]
    if not frames:
        return type(error).__name__
    last = frames[-1]
    return f"{type(error).__name__} {Path(last.filename).name}:{last.lineno} {last.name}"


def main() -> None:
    """Give libFuzzer the target."""
    reader, folder = sys.argv[1], Path(sys.argv[2])
    warnings.simplefilter("ignore")
    account = Account(reader, folder)

    def change(data: bytes, longest: int, seed: int) -> bytes:
        return mutated(data, longest, seed, atheris.Mutate)

    def take(data: bytes) -> None:
        account.take(data)

    atheris.Setup([sys.argv[0], *sys.argv[3:]], take, custom_mutator=change)
    try:
        atheris.Fuzz()
    finally:
        account.save()


if __name__ == "__main__":
    main()
