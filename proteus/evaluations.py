"""Evaluations: models measured on a collection whose shapes have labels."""

from collections.abc import Sequence

from proteus.client import Client, Document
from proteus.terminal.output import Output
from proteus.terminal.waiting import require_success, wait_for_job


def evaluate(
    client: Client,
    output: Output,
    collection: str,
    models: Sequence[str],
    *,
    dissimilarity: str = "",
    title: str = "",
) -> Document:
    """Have models evaluated on a collection, and return the evaluation once it is there.

    Parameters
    ----------
    client : Client
    output : Output
        Where the progress is shown.
    collection : str
    models : sequence of str
        Differences are measured against the first.
    dissimilarity : str
        Of all channels; empty: each channel's own.
    title : str
        Of the progress bar.

    Raises
    ------
    CommandError
        The job failed.
    """
    body: Document = {"collection": collection, "models": list(models)}
    body |= {"dissimilarity": dissimilarity} if dissimilarity else {}
    accepted = client.post("/v1/evaluations", body)
    usual = f"evaluating {len(models)} model{'s' * (len(models) > 1)} on {collection}"
    require_success(wait_for_job(client, output, accepted["job"], title=title or usual))
    return client.get(f"/v1/evaluations/{accepted['evaluation']['id']}")
