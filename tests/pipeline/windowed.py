"""A model that compares windows: heat, with a whitening that only scales and some trust."""

import time
from collections.abc import Sequence
from dataclasses import replace

from sqlalchemy.orm import Session

from tests.retrieval.windows.shapes import EVEN, PLAIN
from workers.geometry.views import window_view
from workers.retrieval.channels import Channel
from workers.retrieval.model import Model
from workers.retrieval.windows.matching import WindowMatching
from workers.storage.models import TrainedModel
from workers.storage.trained_models import load_model


def windowed_model(session: Session, name: str, *, working_vertices: int) -> Model:
    """The model heat under another name, that compares windows too."""
    heat = load_model(session, "heat")
    matching = WindowMatching(
        window_view(working_vertices=working_vertices),
        PLAIN,
        EVEN,
        impostor_quantiles=heat.impostor_quantiles,
    )
    return replace(heat, name=name, windows=matching)


def store_windowed(
    session: Session,
    names: Sequence[str],
    *,
    working_vertices: int,
    more: Sequence[Channel] = (),
) -> None:
    """Store such models, with more channels, as if they had been trained."""
    for name in names:
        model = windowed_model(session, name, working_vertices=working_vertices)
        model = replace(model, channels=(*model.channels, *more))
        session.add(
            TrainedModel(
                name=name,
                method=model.method,
                state="ready",
                built_in=False,
                definition=model.to_json(),
                created_at=time.time(),
            )
        )
    session.flush()
