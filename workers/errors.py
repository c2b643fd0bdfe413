"""Every error that Proteus raises on purpose, in one tree.

A message says what was found and what was expected. The HTTP status of each class
is decided in ``service/errors.py`` alone.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any, Self


class ProteusError(Exception):
    """Root of all errors raised on purpose; the message is fit for a client."""

    @property
    def kind(self) -> str:
        """Name of the class as clients read it: ``InvalidMeshError`` is ``invalid-mesh``."""
        words = re.findall(r"[A-Z][a-z]*", type(self).__name__.removesuffix("Error"))
        return "-".join(words).lower()

    def locate(self, place: str) -> None:
        """Put the place of the fault before the message; nothing else of the error changes.

        Parameters
        ----------
        place : str
            Where in the request the fault is, such as ``queries.3``.
        """
        self.args = (f"{place}: {self}",)


class InvalidMeshError(ProteusError):
    """The bytes are no usable mesh: truncated, NaN, index out of range, no faces."""


class UnsupportedFormatError(ProteusError):
    """The content is of no format that Proteus reads."""


class UploadTooLargeError(ProteusError):
    """A limit on bytes, vertices, faces, files or unpacked size was passed."""


class InvalidRequestError(ProteusError):
    """A request is well formed, but asks for something that makes no sense."""


class KernelDomainError(ProteusError):
    """A kernel is not finite, or negative, on the eigenvalues it was given."""


class NotFoundError(ProteusError):
    """Something was asked for by a name or id that does not exist."""


class ShapeNotFoundError(NotFoundError):
    """No shape has this id."""


class CollectionNotFoundError(NotFoundError):
    """No collection has this name."""


class ModelNotFoundError(NotFoundError):
    """No model has this name."""


class JobNotFoundError(NotFoundError):
    """No job has this id."""


class QueryNotFoundError(NotFoundError):
    """No query has this id."""


class EvaluationNotFoundError(NotFoundError):
    """No evaluation has this id."""


class BlobNotFoundError(NotFoundError):
    """The blob store holds nothing under this key."""


class ConflictError(ProteusError):
    """The request does not fit the present state."""


class NameTakenError(ConflictError):
    """A collection or model of this name exists already."""


class ModelNotReadyError(ConflictError):
    """The model is in training, or the collection is not described under it."""


class ShapeNotReadyError(ConflictError):
    """The shape is still being computed, or its computation failed."""


class InsufficientTrainingDataError(ConflictError):
    """There are too few shapes, labels or transformations to learn from."""


class SpectrumError(ProteusError):
    """The eigenpairs could not be computed, or not be certified."""


class TimeLimitError(ProteusError):
    """The work on one mesh took longer than the settings allow."""


class FailedWorkError(ProteusError):
    """Work that ended earlier without a result; its kind is that of the first failure."""

    def __init__(self, kind: str, detail: str) -> None:
        super().__init__(detail)
        self._kind = kind

    @classmethod
    def of(cls, reasons: Sequence[Mapping[str, Any]]) -> Self:
        """Make the error of a job.

        Parameters
        ----------
        reasons : sequence of Mapping
            Errors of the job, each with ``type`` and ``detail``; none if it was cancelled.

        Returns
        -------
        FailedWorkError
            With kind and message of the first of them.
        """
        if not reasons:
            return cls("cancelled", "the job was cancelled before it had a result")
        return cls(str(reasons[0]["type"]), str(reasons[0]["detail"]))

    @property
    def kind(self) -> str:
        """The kind it was made with."""
        return self._kind
