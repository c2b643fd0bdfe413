"""Which verb does which kind of part.

A verb computes without any transaction and returns an `Outcome`; it commits and sends nothing.
To write a new one: a function of workbench and claim, a kind of part, and a line here.
"""

from collections.abc import Mapping

from workers.pipeline.activate import activate
from workers.pipeline.correspondence import match_meshes
from workers.pipeline.evaluate import evaluate
from workers.pipeline.ingest import ingest
from workers.pipeline.outcome import Outcome, Verb
from workers.pipeline.part_kinds import CORRESPONDENCE
from workers.pipeline.prune import prune
from workers.pipeline.query import answer_query
from workers.pipeline.rank import rank
from workers.pipeline.redescribe import redescribe
from workers.pipeline.training.fit_bank import fit_bank
from workers.pipeline.training.fit_kernel import fit_kernel
from workers.pipeline.training.pair import compute_pair
from workers.pipeline.training.variant import compute_variant
from workers.pipeline.unpack import unpack
from workers.pipeline.workbench import Workbench
from workers.storage.parts import Claim


def watched(verb: Verb) -> Verb:
    """Let a verb tell what it is at: it can be stopped until it returns, and not afterwards.

    Parameters
    ----------
    verb : callable
        Computes a part.

    Returns
    -------
    callable
        Does the same.
    """

    def do(bench: Workbench, claim: Claim) -> Outcome:
        bench.progress.begin(claim)
        try:
            return verb(bench, claim)
        finally:
            bench.progress.end()

    return do


_ALL: Mapping[str, Verb] = {
    "ingest": ingest,
    "unpack": unpack,
    "query": answer_query,
    "describe": redescribe,
    "activate": activate,
    "pair": compute_pair,
    "fit": fit_kernel,
    "variant": compute_variant,
    "fit-bank": fit_bank,
    "rank": rank,
    "evaluate": evaluate,
    "prune": prune,
    CORRESPONDENCE: match_meshes,
}

VERBS: Mapping[str, Verb] = {kind: watched(verb) for kind, verb in _ALL.items()}
