"""The trained model that comes with the program: a file of numbers, and the report of its training.

``make train-default`` writes both; nothing else does.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from workers.geometry.views import named_view, window_view
from workers.retrieval.model import Model
from workers.retrieval.windows.whitening import Whitening

FOLDER = Path(__file__).parent / "shipped"
DEFAULT_MODEL = "proteus"


def shipped_model(*, working_vertices: int = 5000, folder: Path = FOLDER) -> Model:
    """The model `proteus`, the default one.

    Parameters
    ----------
    working_vertices : int
        Of its views, which are those of the code: a test holds them equal to the file's.
    folder : Path
        Where its file is.

    Returns
    -------
    The model as it was trained.
    """
    content = _read(folder / f"{DEFAULT_MODEL}.json")
    names = [view["name"] for view in content["views"]]
    views = [named_view(name, working_vertices=working_vertices).to_json() for name in names]
    model = Model.from_json({**content, "views": views})
    if model.windows is None:
        return model
    view = window_view(working_vertices=working_vertices)
    return replace(model, windows=replace(model.windows, view=view))


@cache
def shipped_whitening() -> Whitening:
    """How the model `proteus` compares windows: points are matched in the same way.

    Returns
    -------
    Whitening
        As it was learned from creatures.
    """
    return Whitening.from_json(_read(FOLDER / f"{DEFAULT_MODEL}.json")["windows"]["whitening"])


def shipped_views(folder: Path = FOLDER) -> list[dict[str, Any]]:
    """Views of the model `proteus` as they were when it was trained.

    Parameters
    ----------
    folder : Path
        Where its file is.

    Returns
    -------
    The views as JSON.
    """
    views: list[dict[str, Any]] = _read(folder / f"{DEFAULT_MODEL}.json")["views"]
    return views


def shipped_report(folder: Path = FOLDER) -> Mapping[str, Any]:
    """What the training of the model `proteus` found.

    Parameters
    ----------
    folder : Path
        Where its file is.

    Returns
    -------
    Rows, ablation, calibration, versions, and how it was made, as JSON.
    """
    return _read(folder / f"{DEFAULT_MODEL}.report.json")


def shipped_training() -> Mapping[str, Any]:
    """The report as people read it, without the descriptors that tests compare the code with.

    Returns
    -------
    What `shipped_report` gives but for its entry ``witnesses``.
    """
    return {name: value for name, value in shipped_report().items() if name != "witnesses"}


def write_shipped(definition: Mapping[str, Any], report: Mapping[str, Any], folder: Path) -> None:
    """Write a trained bank as the model `proteus`, with its report; the same bytes for the same.

    Parameters
    ----------
    definition : Mapping
        The trained model as JSON; its name is replaced.
    report : Mapping
        What its training found, as JSON.
    folder : Path
        Where both files go; made if it is missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    model = Model.from_json({**definition, "name": DEFAULT_MODEL})
    for name, content in (("json", model.to_json()), ("report.json", report)):
        text = json.dumps(content, indent=1, ensure_ascii=False, sort_keys=True, allow_nan=False)
        (folder / f"{DEFAULT_MODEL}.{name}").write_text(text + "\n", encoding="utf-8")


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
