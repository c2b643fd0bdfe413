"""Rows that storage tests need."""

import time

from sqlalchemy.orm import Session

from workers.storage.collections import create_collection
from workers.storage.models import Collection, TrainedModel
from workers.storage.shapes import NewShape, create_shape


def make_collection(session: Session, name: str = "zoo") -> Collection:
    return create_collection(session, name=name, description="", model="heat")


def make_shape(
    session: Session, collection: Collection, content: int, *, label: str | None = None
) -> str:
    shape = NewShape(sha256=f"{content:064x}", n_bytes=1, name=f"{content}.off", label=label)
    return create_shape(session, collection.id, shape)[0]


def make_model(session: Session, name: str, state: str = "ready") -> None:
    heat = session.get(TrainedModel, "heat")
    assert heat is not None
    session.add(
        TrainedModel(
            name=name,
            method="heat",
            state=state,
            built_in=False,
            definition={**heat.definition, "name": name},
            created_at=time.time(),
        )
    )
    session.flush()
