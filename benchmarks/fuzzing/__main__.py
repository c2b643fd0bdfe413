"""Coverage-guided fuzzing of every reader of mesh files, with atheris.

``python -m benchmarks.fuzzing`` starts from the files that the tests build, and lets libFuzzer
change them as far as they reach code that no other reached. Each input is read under small limits,
and cleaned where it is small. It counts as a finding where reading raises anything but the
package's own errors, takes more than 2 s or more than 20 times the file in memory, breaks what it
promises of a mesh, or ends the process. The smallest input of each finding is kept.

A reader runs in a process of its own, started again after a crash. With ``--corpus`` what was
found to reach new code is kept for the next run, and with ``--out`` the totals are added up.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.fuzzing.seeds import ANY, dictionary, seeds, write_seeds

LARGEST_BYTES = 1 << 15
HANG_SECONDS = 60
"""Of one input, on the clock; the limit of 2 s is of processor time."""
MEMORY_MEGABYTES = 4096
CRASHES = ("crash", "timeout", "oom")
FINDINGS = ("raised", "slow", "memory", "broken", *CRASHES)
OUTCOMES = ("cleaned", "refused when cleaned", "read", "refused", "unnamed")
Totals = dict[str, dict[str, Any]]


def fuzz(
    reader: str, folder: Path, *, files: Sequence[bytes], inputs: int, seconds: int
) -> dict[str, Any]:
    """Fuzz one reader until it had so many inputs or so many seconds; return its totals.

    Parameters
    ----------
    reader : str
        A format, or ``any``.
    folder : Path
        Of this reader: ``corpus``, ``findings`` and the dictionary.
    files : sequence of bytes
        To start from.
    inputs, seconds : int
    """
    corpus, findings = folder / "corpus", folder / "findings"
    findings.mkdir(parents=True, exist_ok=True)
    write_seeds(list(files), corpus)
    words = folder / "words.dict"
    words.write_text(dictionary(list(files)) or '"none"\n')  # libFuzzer ends over an empty one
    counts: Counter[str] = Counter()
    unnamed: Counter[str] = Counter()
    start = time.monotonic()
    while counts["inputs"] < inputs and (left := seconds - (time.monotonic() - start)) > 1:
        before = counts["inputs"]
        runs = inputs - before
        status = _run(reader, findings, corpus, words, runs, round(left))
        account = json.loads((findings / "account.json").read_text())
        counts.update(account["counts"])
        unnamed.update(account["unnamed"])
        if status == 0 and counts["inputs"] == before:
            break
    found = sorted(path.name for path in findings.iterdir() if path.suffix != ".json")
    for kind in CRASHES:
        counts[kind] = sum(name.startswith(f"{kind}-") for name in found)
    return {
        "counts": dict(counts),
        "unnamed": dict(unnamed.most_common(20)),
        "seconds": round(time.monotonic() - start),
        "corpus": sum(1 for _ in corpus.iterdir()),
        "findings": [name for name in found if not name.endswith(".txt")],
    }


def _run(reader: str, findings: Path, corpus: Path, words: Path, runs: int, seconds: int) -> int:
    """Run libFuzzer once; return its exit status."""
    (findings / "account.json").write_text('{"counts": {}, "unnamed": {}}')
    options = (
        f"-runs={runs} -max_total_time={seconds} -max_len={LARGEST_BYTES} -timeout={HANG_SECONDS} "
        f"-rss_limit_mb={MEMORY_MEGABYTES} -dict={words} -artifact_prefix={findings}/ "
        "-report_slow_units=3600 -verbosity=0 -len_control=20"
    ).split()
    command = [sys.executable, "-m", "benchmarks.fuzzing.target", reader, str(findings)]
    with (findings.parent / "log.txt").open("wb") as log:
        return subprocess.run([*command, *options, str(corpus)], stdout=log, stderr=log).returncode


def added(before: Totals, reader: str, now: dict[str, Any]) -> Totals:
    """Return the totals with those of one more run."""
    old = before.get(reader, {"counts": {}, "unnamed": {}, "seconds": 0})
    counts: Counter[str] = Counter(old["counts"]) + Counter(now["counts"])
    for kind in CRASHES:
        counts[kind] = now["counts"].get(kind, 0)  # they are counted in the folder
    unnamed: Counter[str] = Counter(old["unnamed"]) + Counter(now["unnamed"])
    seconds = old["seconds"] + now["seconds"]
    one = now | {"counts": dict(counts), "unnamed": dict(unnamed), "seconds": seconds}
    return {**before, reader: one}


def table(totals: Totals) -> Table:
    """Return one row a reader."""
    rows = Table(caption="unnamed: refused as damaged, without the cause")
    for column in ("reader", "inputs", "a second", "corpus", *OUTCOMES, "findings"):
        rows.add_column(column, justify="left" if column in ("reader", "findings") else "right")
    for reader, one in sorted(totals.items()):
        counts: Counter[str] = Counter(one["counts"])
        found = [f"{counts[kind]} {kind}" for kind in FINDINGS if counts[kind]]
        rows.add_row(
            *(reader, f"{counts['inputs']:,}", f"{counts['inputs'] / max(one['seconds'], 1):.0f}"),
            *(f"{count:,}" for count in (one["corpus"], *(counts[name] for name in OUTCOMES))),
            ", ".join(found) or "none",
        )
    whole = sum(one["counts"].get("inputs", 0) for one in totals.values())
    rows.add_section()
    rows.add_row("all", f"{whole:,}")
    return rows


def main() -> None:
    """Fuzz, add up, print; the exit code is 1 where something was found."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.fuzzing",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    known = seeds()
    parser.add_argument("--reader", action="append", choices=sorted(known), help="default: all")
    parser.add_argument("--inputs", type=int, default=100_000, help="for a reader")
    parser.add_argument("--seconds", type=int, default=600, help="for a reader")
    parser.add_argument("--corpus", type=Path, help="folder that keeps corpora and findings")
    parser.add_argument("--out", type=Path, default=Path("fuzzing.json"), help="totals")
    asked = parser.parse_args()
    totals: Totals = json.loads(asked.out.read_text()) if asked.out.is_file() else {}
    folder = asked.corpus or Path(tempfile.mkdtemp(prefix="proteus-fuzzing-"))
    messages = Console(stderr=True)
    for reader in asked.reader or [*(name for name in sorted(known) if name != ANY), ANY]:
        with messages.status(f"fuzzing {reader}"):
            limits = {"inputs": asked.inputs, "seconds": asked.seconds}
            now = fuzz(reader, folder / reader, files=known[reader], **limits)
        totals = added(totals, reader, now)
        asked.out.write_text(json.dumps(totals, indent=1) + "\n")
        messages.print(f"{reader}: {now['counts'].get('inputs', 0):,} inputs")
    messages.print(f"inputs of findings are below {folder}")
    Console(width=150).print(table(totals))
    sys.exit(any(one["findings"] for one in totals.values()))


if __name__ == "__main__":
    main()
