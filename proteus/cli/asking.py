"""Asking a service which shapes are like a mesh or a region, for as long as the answer takes."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from proteus.client import Client, Document, json_object
from proteus.terminal.output import Output
from proteus.terminal.waiting import PATIENCE_SECONDS, require_success, wait_for_job

if TYPE_CHECKING:
    import httpx  # which the client brings along where it is needed

WAIT_SECONDS = 2  # for an answer at once; then there is a bar that says what is done


@dataclass(frozen=True)
class Asked:
    """An answer, and where the service keeps what it was asked with.

    Attributes
    ----------
    result : Document
        The contract's QueryResult.
    place : str
        Path of the query or of the stored shape: its mesh and correspondences lie below it.
    """

    result: Document
    place: str


def query_by_mesh(
    client: Client,
    output: Output,
    collection: str,
    name: str,
    content: bytes,
    options: Mapping[str, Any],
) -> Asked:
    """Ask with a mesh, waiting for its computation as long as it takes.

    Parameters
    ----------
    output : Output
        Shows what is done meanwhile.
    name, content : str, bytes
        The mesh file.
    options : mapping
        ``limit``, ``model``, ``dissimilarity``, ``match``, ``filter`` as in the contract.
    """
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    fields = {
        key: json.dumps(value) if isinstance(value, dict) else str(value)
        for key, value in options.items()
    }
    answer = client.request(
        "POST",
        f"/v1/collections/{collection}/query/mesh",
        params={"wait": WAIT_SECONDS},
        data=fields,
        files=[("mesh", (name, content))],
    )
    return _await_result(client, output, answer, title=name)


def query_by_region(
    client: Client, output: Output, collection: str, body: Mapping[str, Any]
) -> Asked:
    """Ask with a region, waiting for its computation as long as it takes.

    Parameters
    ----------
    output : Output
        Shows what is done meanwhile.
    body : mapping
        ``shape_id``, ``region`` and options as in the contract.
    """
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    answer = client.request(
        "POST",
        f"/v1/collections/{collection}/query",
        params={"wait": WAIT_SECONDS},
        json=body,
    )
    return _await_result(client, output, answer, title="region")


def _await_result(client: Client, output: Output, answer: "httpx.Response", *, title: str) -> Asked:
    """Return the result that was answered, or that a job is making."""
    place = answer.headers["Location"]
    if answer.status_code != 202:
        return Asked(json_object(answer), place)
    accepted = json_object(answer)
    require_success(wait_for_job(client, output, accepted["job"], title=title))
    return Asked(client.get(place), place)
