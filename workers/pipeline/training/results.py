"""What is computed of an example, stored by its content: equal examples are computed once."""

import json
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from numpy.typing import NDArray

from workers.errors import (
    BlobNotFoundError,
    InsufficientTrainingDataError,
    InvalidMeshError,
    InvalidRequestError,
    KernelDomainError,
    SpectrumError,
)
from workers.pipeline.outcome import Outcome
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import BlobStore, failure_key, training_key
from workers.storage.parts import Failure
from workers.training.examples import Example

OWN_REASONS = (
    InsufficientTrainingDataError,
    InvalidMeshError,
    InvalidRequestError,
    KernelDomainError,
    SpectrumError,
)
"""Why an example may fail again and again: the training goes on without it."""

Arrays: TypeAlias = Mapping[str, NDArray[Any]]


def store_result(blobs: BlobStore, example: Example, compute: Callable[[], Arrays]) -> Outcome:
    """Store what is computed of an example, unless it is there already.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    example : Example
        A pair or a variant.
    compute : callable
        Computes the arrays.

    Returns
    -------
    Outcome
        Names the example if it fails for a reason of its own; the reason is stored instead.

    Raises
    ------
    ProteusError
        It fails for another reason, so that another run may succeed.
    """
    try:
        if not blobs.exists(training_key(example.kind, example.key)):
            blobs.put(training_key(example.kind, example.key), pack(compute()))
    except OWN_REASONS as error:
        failure = Failure(example.item, error.kind, str(error))
        document = json.dumps(vars(failure)).encode()
        blobs.put(failure_key(example.kind, example.key), document)
        return Outcome(failures=[failure])
    return Outcome()


def load_result(blobs: BlobStore, example: Example) -> Arrays | Failure:
    """Return what is stored of an example.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    example : Example
        A pair or a variant.

    Returns
    -------
    mapping of str to array, or Failure
        The arrays by name, or why there are none.

    Raises
    ------
    BlobNotFoundError
        It was not computed.
    """
    try:
        return unpack(blobs.get(training_key(example.kind, example.key)))
    except BlobNotFoundError:
        reason = json.loads(blobs.get(failure_key(example.kind, example.key)))
        return Failure(example.item, reason["type"], reason["detail"])
