"""Work on several processors, and files that are written whole or not at all."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def run_in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], *, processes: int
) -> Iterator[Result]:
    """Call a function for each item, on several processors; results come as they are ready.

    Parameters
    ----------
    function : callable
        Can be pickled, as its items and results can.
    items : sequence
    processes : int
        How many to use; at least 1.

    Yields
    ------
    result
        In no fixed order. A Ctrl-C cancels the items that are not begun.
    """
    pool = ProcessPoolExecutor(
        max_workers=max(1, min(processes, len(items))),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_ignore_interrupts,
    )
    try:
        parts = [pool.submit(function, item) for item in items]
        yield from (part.result() for part in as_completed(parts))
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """Leave a Ctrl-C to the parent, which cancels the rest in order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is either missing or whole, even if the process is killed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".part")
    unfinished.write_bytes(content)
    unfinished.replace(path)
