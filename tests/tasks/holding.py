"""Included in a worker: work that takes as long as a test wants, and hears nothing meanwhile.

A mesh of the bytes ``hold STEP`` stays at that step for a minute, with the interpreter's lock
held as LAPACK holds it. All else is worked on as ever.
"""

import ctypes
from collections.abc import MutableMapping
from typing import cast

from workers.pipeline.outcome import Outcome, Verb
from workers.pipeline.verbs import VERBS, watched
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import mesh_key
from workers.storage.models import Shape
from workers.storage.parts import Claim

SECONDS = 60
HOLD = b"hold "


def _bytes_of(bench: Workbench, claim: Claim) -> bytes:
    sha256 = claim.payload.get("sha256")
    if sha256 is None:
        with bench.database.read() as session:
            sha256 = session.get_one(Shape, claim.shape_id).sha256
    return bench.blobs.get(mesh_key(sha256))


def _holding(verb: Verb) -> Verb:
    def do(bench: Workbench, claim: Claim) -> Outcome:
        data = _bytes_of(bench, claim)
        if not data.startswith(HOLD):
            return verb(bench, claim)
        bench.progress.enter(data.removeprefix(HOLD).decode().strip())
        ctypes.PyDLL(None).sleep(SECONDS)  # unlike CDLL, it keeps the lock
        return Outcome()

    return do


for _kind in ("query", "ingest"):
    cast(MutableMapping[str, Verb], VERBS)[_kind] = watched(_holding(VERBS[_kind]))
