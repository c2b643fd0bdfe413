"""Multipart forms, streamed to disk and hashed as they arrive, in bounded memory."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from fastapi import Request
from fastapi.concurrency import run_in_threadpool
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header

from service.errors import RefusedError
from service.schemas.text import check_text
from workers.errors import InvalidRequestError, UploadTooLargeError

FEED_BYTES = 512 << 10
FIELD_BYTES = 64 << 10
MAX_FIELDS = 32
TYPE = "multipart/form-data"


@dataclass(frozen=True)
class FormLimits:
    """What a form may hold.

    Attributes
    ----------
    file_fields, text_fields : frozenset of str
        Names of the parts that are files, and of those that are texts.
    """

    file_fields: frozenset[str]
    text_fields: frozenset[str]
    max_files: int
    max_file_bytes: int


@dataclass(frozen=True)
class ReceivedFile:
    """A file of a form, on disk."""

    name: str
    path: Path
    sha256: str
    size: int


@dataclass(frozen=True)
class ReceivedForm:
    """A form as it was received; its files belong to whoever has it."""

    files: tuple[ReceivedFile, ...] = ()
    fields: Mapping[str, str] = field(default_factory=dict)


async def receive_form(request: Request, folder: Path, limits: FormLimits) -> ReceivedForm:
    """Read a request's form, its files into a folder.

    Raises
    ------
    RefusedError
        415: the body is no multipart form.
    InvalidRequestError
        The form is damaged, ends early, or has a part that does not belong there.
    UploadTooLargeError
        A file is too large, or there are too many.
    """
    given, parameters = parse_options_header(request.headers.get("content-type"))
    if given != TYPE.encode():
        shown = given.decode("latin-1")[:100] or "of no declared type"
        detail = f"the body is {shown}, expected {TYPE}"
        raise RefusedError("unsupported-media-type", 415, detail)
    boundary = parameters.get(b"boundary")
    if not boundary:
        raise InvalidRequestError(f"the type {TYPE} lacks its boundary")
    reader = _FormReader(boundary, folder, limits)
    try:
        waiting = bytearray()
        async for chunk in request.stream():
            waiting += chunk
            if len(waiting) >= FEED_BYTES:
                await run_in_threadpool(reader.feed, bytes(waiting))
                waiting.clear()
        await run_in_threadpool(reader.feed, bytes(waiting))
        return reader.finish()
    finally:
        reader.close()


class _FormReader:
    """Callbacks of the parser: they name the current part and store its bytes."""

    def __init__(self, boundary: bytes, folder: Path, limits: FormLimits) -> None:
        self._folder = folder
        self._limits = limits
        self._parser = MultipartParser(
            boundary,
            {
                "on_part_begin": self._begin_part,
                "on_header_field": self._add_header_name,
                "on_header_value": self._add_header_value,
                "on_header_end": self._end_header,
                "on_headers_finished": self._end_headers,
                "on_part_data": self._add_data,
                "on_part_end": self._end_part,
                "on_end": self._end,
            },
        )
        self._files: list[ReceivedFile] = []
        self._fields: dict[str, str] = {}
        self._ended = False
        self._file: BinaryIO | None = None
        self._begin_part()

    def feed(self, data: bytes) -> None:
        try:
            self._parser.write(data)
        except FormParserError as error:
            raise InvalidRequestError(f"the multipart form is damaged: {error}") from None

    def finish(self) -> ReceivedForm:
        if not self._ended:
            raise InvalidRequestError("the multipart form ends before its last boundary")
        return ReceivedForm(tuple(self._files), dict(self._fields))

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def _begin_part(self) -> None:
        self._headers: dict[bytes, bytes] = {}
        self._header_name = b""
        self._header_value = b""
        self._field_name = ""
        self._file_name = ""
        self._text = bytearray()

    def _add_header_name(self, data: bytes, start: int, end: int) -> None:
        self._header_name += data[start:end]

    def _add_header_value(self, data: bytes, start: int, end: int) -> None:
        self._header_value += data[start:end]

    def _end_header(self) -> None:
        self._headers[self._header_name.lower()] = self._header_value
        self._header_name = self._header_value = b""

    def _end_headers(self) -> None:
        _, options = parse_options_header(self._headers.get(b"content-disposition"))
        name = _decode(options.get(b"name", b""))
        if b"filename" in options:
            self._begin_file(name, _decode_file_name(options[b"filename"]))
        else:
            self._begin_field(name)

    def _begin_file(self, name: str, file_name: str) -> None:
        if name not in self._limits.file_fields:
            raise _stray(name, self._limits.file_fields, "file")
        if len(self._files) >= self._limits.max_files:
            raise UploadTooLargeError(
                f"the form has more than {self._limits.max_files} files, which is the most"
            )
        self._field_name, self._file_name = name, file_name
        self._hash = hashlib.sha256()
        self._size = 0
        self._path = self._folder / f"{len(self._files):06d}"
        self._file = self._path.open("xb")

    def _begin_field(self, name: str) -> None:
        if name in self._limits.file_fields:
            raise InvalidRequestError(f"the part {name!r} has no file name, expected a file")
        if name not in self._limits.text_fields:
            raise _stray(name, self._limits.text_fields, "text")
        if name in self._fields or len(self._fields) >= MAX_FIELDS:
            raise InvalidRequestError(f"the form has the field {name!r} more than once")
        self._field_name = name

    def _add_data(self, data: bytes, start: int, end: int) -> None:
        if self._file is None:
            self._text += data[start:end]
            if len(self._text) > FIELD_BYTES:
                raise UploadTooLargeError(
                    f"the field {self._field_name!r} has more than {FIELD_BYTES} bytes"
                )
            return
        self._size += end - start
        if self._size > self._limits.max_file_bytes:
            raise UploadTooLargeError(
                f"the file {self._file_name!r} has more than {self._limits.max_file_bytes} bytes, "
                "which is the most for one file"
            )
        chunk = memoryview(data)[start:end]
        self._hash.update(chunk)
        self._file.write(chunk)

    def _end_part(self) -> None:
        if self._file is None:
            self._fields[self._field_name] = _storable(self._field_name, _decode(self._text))
            return
        self.close()
        if not self._file_name and not self._size:  # a browser's empty file field
            self._path.unlink()
            return
        digest = self._hash.hexdigest()
        self._files.append(ReceivedFile(self._file_name, self._path, digest, self._size))

    def _end(self) -> None:
        self._ended = True


def _decode(data: bytes | bytearray) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _decode_file_name(data: bytes) -> str:
    """Undo what HTML prescribes for quotes and line ends in file names."""
    name = _decode(data)
    for escaped, plain in (("%22", '"'), ("%0D", ""), ("%0A", "")):
        name = name.replace(escaped, plain)
    return name


def _storable(name: str, text: str) -> str:
    try:
        return check_text(text)
    except ValueError as error:
        raise InvalidRequestError(f"{name}: {error}") from None


def _stray(name: str, expected: frozenset[str], what: str) -> InvalidRequestError:
    known = ", ".join(sorted(expected)) or "none"
    return InvalidRequestError(
        f"the form has a {what} part named {name[:60]!r}, expected {what} parts: {known}"
    )
