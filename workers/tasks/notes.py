"""What each process of a worker is at: one small file a process, which the parent reads.

The parent makes the folder before its first child and names it in their environment. A file says
which claim is worked on, at which step, and since when. It costs a tenth of a millisecond, so
every step can be told; what becomes of it is decided by the parent (`workers.tasks.watch`).
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

    def write(self, process: int, note: Note) -> None:
        """Replace the note of a process.

        Parameters
        ----------
        process : int
            Its number.
        note : Note
            What it is at.
        """
        path = self._path(process)
        path.parent.mkdir(mode=0o700, exist_ok=True)  # programs that tidy up remove old ones
        unfinished = path.with_suffix(".part")
        unfinished.write_text(json.dumps(asdict(note)))
        unfinished.replace(path)

    def remove(self, process: int) -> None:
        """Note that a process is at nothing.

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
            None if it is at nothing.
        """
        try:
            return Note(**json.loads(self._path(process).read_text()))
        except FileNotFoundError:
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


class NotedProgress(Progress):
    """Writes down what this process is at.

    Parameters
    ----------
    notes : Notes
        Of this worker. A disk that is full does no harm: then nobody is told.
    """

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._process = os.getpid()
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
            self._notes.write(self._process, self._note)

    def end(self) -> None:
        """Write down that nothing is computed any more."""
        if self._note is not None:
            self._note = None
            with suppress(OSError):
                self._notes.remove(self._process)


def progress_of_this_process() -> Progress:
    """How this process tells what it is at.

    Returns
    -------
    Progress
        One that writes notes, if a parent named a folder for them.
    """
    folder = os.environ.get(FOLDER_VARIABLE)
    return NotedProgress(Notes(Path(folder))) if folder else Progress()
