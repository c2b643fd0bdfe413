"""Which parts a job has: kinds of parts, their payloads and their queues."""

from collections.abc import Mapping, Sequence
from typing import Any

from workers.settings import INGEST, LIGHT
from workers.storage.jobs import NewPart
from workers.training.examples import Example

SHAPES_A_PART = 25
QUERIES_A_PART = 250
CORRESPONDENCE = "correspondence"
"""Kind of jobs and of their parts."""


def ingest_part(shape_id: str) -> NewPart:
    """Compute an uploaded shape until it can be found.

    Parameters
    ----------
    shape_id : str
        Id of its row.

    Returns
    -------
    NewPart
        For workers that solve eigenproblems.
    """
    return NewPart("ingest", INGEST, {}, shape_id=shape_id)


def unpack_part(
    collection_id: str,
    sha256: str,
    *,
    filename: str,
    label: str | None,
    attributes: Mapping[str, Any],
    folder_is_label: bool = True,
) -> NewPart:
    """Make shapes of an uploaded archive's entries, each with a part of its own.

    Parameters
    ----------
    collection_id : str
        Whose shapes they become.
    sha256 : str
        Of the archive's bytes.
    filename : str
        What people call the archive.
    label : str or None
        Label of all shapes; without one the entries' names give it.
    attributes : mapping of str
        Attributes of all shapes.
    folder_is_label : bool
        Whether the folder of an entry is its label, where its name gives none.

    Returns
    -------
    NewPart
        It adds nothing to the progress: the shapes do.
    """
    payload = {
        "collection_id": collection_id,
        "sha256": sha256,
        "filename": filename,
        "label": label,
        "attributes": dict(attributes),
        "folder_is_label": folder_is_label,
    }
    return NewPart("unpack", LIGHT, payload, weight=0)


def entry_parts(archive: Mapping[str, Any], ranges: Sequence[tuple[int, int]]) -> list[NewPart]:
    """Unpack a long archive, some entries a part.

    Parameters
    ----------
    archive : mapping of str
        Payload of the part that unpacks the whole archive.
    ranges : sequence of (int, int)
        Place of the first entry of each part, and of the one after its last.

    Returns
    -------
    list of NewPart
        In the order of the archive.
    """
    return [
        NewPart("unpack", LIGHT, {**archive, "start": start, "stop": stop}, weight=0)
        for start, stop in ranges
    ]


def query_part(sha256: str, model: str, filename: str) -> NewPart:
    """Describe the mesh of a query.

    Parameters
    ----------
    sha256 : str
        Of the mesh's bytes.
    model : str
        Name of the model to describe it under.
    filename : str
        What people call the mesh.

    Returns
    -------
    NewPart
        For workers of what is quick, so that it overtakes uploads.
    """
    return NewPart("query", LIGHT, {"sha256": sha256, "model": model, "filename": filename})


def describe_parts(shape_ids: list[str], model: str, *, marks_shapes: bool = True) -> list[NewPart]:
    """Describe shapes under a model from their stored spectra, some shapes a part.

    Parameters
    ----------
    shape_ids : list of str
        Ids of their rows.
    model : str
        Name of the model to describe them under.
    marks_shapes : bool
        Whether a shape that fails gets an error of its own; otherwise only the job names it.

    Returns
    -------
    list of NewPart
        Each counts as many shapes as it describes.
    """
    chunks = [
        shape_ids[start : start + SHAPES_A_PART]
        for start in range(0, len(shape_ids), SHAPES_A_PART)
    ]
    return [
        NewPart(
            "describe",
            LIGHT,
            {"shape_ids": chunk, "model": model, "marks_shapes": marks_shapes},
            weight=len(chunk),
        )
        for chunk in chunks
    ]


def activate_part(collection_id: str, model: str) -> NewPart:
    """Move a collection to a model once every shape is described under it.

    Parameters
    ----------
    collection_id : str
        Id of its row.
    model : str
        Name of the model.

    Returns
    -------
    NewPart
        It adds nothing to the progress.
    """
    return NewPart("activate", LIGHT, {"collection_id": collection_id, "model": model}, weight=0)


def evaluate_part(evaluation_id: str, collection_id: str, frame: str) -> NewPart:
    """Have the queries of a frame ranked, or put the rankings into tables.

    Parameters
    ----------
    evaluation_id, collection_id : str
        Ids of their rows.
    frame : str
        Digest of what is compared.

    Returns
    -------
    NewPart
        It adds nothing to the progress.
    """
    payload = {"evaluation_id": evaluation_id, "collection_id": collection_id, "frame": frame}
    return NewPart("evaluate", LIGHT, payload, weight=0)


def rank_parts(
    evaluation: NewPart,
    models: Sequence[str],
    *,
    dissimilarity: str | None,
    queries: int,
    queries_a_part: int = QUERIES_A_PART,
) -> list[NewPart]:
    """Rank the queries of an evaluation's frame under each model, some queries a part.

    Parameters
    ----------
    evaluation : NewPart
        The part that puts the rankings into tables; names the frame.
    models : sequence of str
        Their places number the rankings.
    dissimilarity : str or None
        Takes the place of the models' own dissimilarities.
    queries : int
        How many queries the frame has.
    queries_a_part : int
        At most so many queries in one part.

    Returns
    -------
    list of NewPart
        Model after model, and range after range.
    """
    parts = []
    for number, model in enumerate(models):
        asked = {"model": model, "item": model, "number": number, "dissimilarity": dissimilarity}
        for start, stop in query_ranges(queries, queries_a_part):
            payload = {**evaluation.payload, **asked, "start": start, "stop": stop}
            parts.append(NewPart("rank", LIGHT, payload, weight=stop - start))
    return parts


def query_ranges(queries: int, queries_a_part: int = QUERIES_A_PART) -> list[tuple[int, int]]:
    """Split the queries of a frame into those of each part.

    Parameters
    ----------
    queries : int
        How many queries the frame has.
    queries_a_part : int
        At most so many queries in one part.

    Returns
    -------
    list of (int, int)
        Place of the first query, and of the one after the last.
    """
    starts = range(0, queries, queries_a_part)
    return [(start, min(start + queries_a_part, queries)) for start in starts]


def example_part(example: Example) -> NewPart:
    """Compute what is learned of a pair or a variant.

    Parameters
    ----------
    example : Example
        It becomes the payload.

    Returns
    -------
    NewPart
        For workers that solve eigenproblems.
    """
    return NewPart(example.kind, INGEST, example.to_payload())


def fit_part(model: str) -> NewPart:
    """Learn a kernel from the moments of all pairs.

    Parameters
    ----------
    model : str
        Name of the model that it becomes.

    Returns
    -------
    NewPart
        It adds nothing to the progress.
    """
    return NewPart("fit", LIGHT, {"model": model, "item": model}, weight=0)


def fit_bank_part(model: str) -> NewPart:
    """Choose and weigh channels by the descriptors of all variants.

    Parameters
    ----------
    model : str
        Name of the model that they become.

    Returns
    -------
    NewPart
        It adds nothing to the progress.
    """
    return NewPart("fit-bank", LIGHT, {"model": model, "item": model}, weight=0)


def correspondence_part(first: str, second: str) -> NewPart:
    """Find the points of one stored mesh for those of another.

    Parameters
    ----------
    first, second : str
        SHA-256 of the uploaded meshes.

    Returns
    -------
    NewPart
        Somebody waits for it, as for a query.
    """
    payload = {"sha256": first, "other": {"sha256": second}, "item": f"{first[:8]} to {second[:8]}"}
    return NewPart(CORRESPONDENCE, LIGHT, payload)
