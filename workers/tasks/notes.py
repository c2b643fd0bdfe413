"""What each process of a worker is at: one small file a process, which the parent reads.

The parent makes the folder before its first child and names it in their environment. A file says
which claim is worked on, at which step, and since when. All notes of a mesh cost 0.05 ms, so
every step can be told. What becomes of it is decided by the parent (`workers.tasks.watch`).
"""

import json
import os
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from workers.pipeline.progress import Progress
from workers.storage.parts import Claim

FOLDER_VARIABLE = "WORKER_NOTES_FOLDER"
"""Where the parent tells its children the folder; it is no setting."""

LENGTH = 512  # bytes of a note, filled up with spaces


@dataclass(frozen=True)
class Note:
    """What one process is at.

    Attributes
    ----------
    kind, part_id, owner : str
        Of the claim.
    shape_id : str or None
        The shape whose turn it is, in a part of several.
    step : str
        As `workers.pipeline.progress` names it.
    since : float
        When the work on this mesh was begun, by the clock ``time.monotonic`` of this machine.
    """

    kind: str
    part_id: str
    owner: str
    shape_id: str | None
    step: str
    since: float


class Notes:
    """The notes of all processes of a worker.

    Parameters
    ----------
    folder : Path
        Of this worker alone.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def writer(self, process: int) -> "NoteWriter":
        """What writes the notes of one process.

        Parameters
        ----------
        process : int
            Its number.

        Returns
        -------
        NoteWriter
            The only one that should write there.
        """
        return NoteWriter(self._path(process))

    def remove(self, process: int) -> None:
        """Forget a process that was ended.

        Parameters
        ----------
        process : int
            Its number.
        """
        self._path(process).unlink(missing_ok=True)

    def read(self, process: int) -> Note | None:
        """What a process is at.

        Parameters
        ----------
        process : int
            Its number.

        Returns
        -------
        Note or None
            None if it is at nothing, or is just writing.
        """
        try:
            text = self._path(process).read_text()
            return Note(**json.loads(text)) if text.strip() else None
        except (FileNotFoundError, ValueError):
            return None

    def read_all(self) -> dict[int, Note]:
        """What all processes are at.

        Returns
        -------
        dict of int to Note
            By the number of the process.
        """
        processes = [int(path.stem) for path in self._folder.glob("*.json")]
        notes = {process: self.read(process) for process in processes}
        return {process: note for process, note in notes.items() if note is not None}

    def _path(self, process: int) -> Path:
        return self._folder / f"{process}.json"


class NoteWriter:
    """Writes the note of one process, always over the one before.

    Whoever reads at that moment may find halves of two notes. So the parent reads again before it
    does anything that cannot be undone.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None

    def write(self, note: Note | None) -> None:
        """Replace what is noted.

        Parameters
        ----------
        note : Note or None
            None if the process is at nothing.

        Raises
        ------
        OSError
            The disk is full.
        """
        text = "" if note is None else json.dumps(asdict(note))
        os.pwrite(self._open(), text.ljust(LENGTH).encode(), 0)

    def _open(self) -> int:
        """The open file; a new one if programs that tidy up have removed it."""
        if self._file is not None and os.fstat(self._file).st_nlink == 0:
            os.close(self._file)
            self._file = None
        if self._file is None:
            self._path.parent.mkdir(mode=0o700, exist_ok=True)
            self._file = os.open(self._path, os.O_CREAT | os.O_WRONLY | os.O_CLOEXEC, 0o600)
        return self._file


class NotedProgress(Progress):
    """Writes down what this process is at.

    Parameters
    ----------
    writer : NoteWriter
        Of this process. A disk that is full does no harm: then nobody is told.
    """

    def __init__(self, writer: NoteWriter) -> None:
        self._writer = writer
        self._claim: Claim | None = None
        self._shape_id: str | None = None
        self._note: Note | None = None

    def begin(self, claim: Claim, shape_id: str | None = None) -> None:
        """Begin a part, or the next mesh of a part; see `Progress`.

        Parameters
        ----------
        claim : Claim
            The part that this worker holds.
        shape_id : str, optional
            The shape whose turn it is.
        """
        self.end()
        self._claim, self._shape_id = claim, shape_id

    def enter(self, step: str) -> None:
        """Write down the step that is begun now.

        Parameters
        ----------
        step : str
            Its name.
        """
        before, claim = self._note, self._claim
        if claim is None or (before is not None and before.step == step):
            return
        since = time.monotonic() if before is None else before.since
        self._note = Note(claim.kind, claim.part_id, claim.owner, self._shape_id, step, since)
        with suppress(OSError):
            self._writer.write(self._note)

    def end(self) -> None:
        """Write down that nothing is computed any more."""
        if self._note is not None:
            self._note = None
            with suppress(OSError):
                self._writer.write(None)


def progress_of_this_process() -> Progress:
    """How this process tells what it is at.

    Returns
    -------
    Progress
        One that writes notes, if a parent named a folder for them.
    """
    folder = os.environ.get(FOLDER_VARIABLE)
    return NotedProgress(Notes(Path(folder)).writer(os.getpid())) if folder else Progress()
