"""Which pairs are learned from, and what is refused before anything is written."""

import random
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from tests.meshes import bumpy_sphere
from tests.pipeline.trainings import begin_training, definition, pairs_for, small_bench, work
from workers.creatures import SPECIES
from workers.errors import (
    CollectionNotFoundError,
    InsufficientTrainingDataError,
    InvalidRequestError,
    ProteusError,
    ShapeNotReadyError,
)
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import mesh_key
from workers.storage.collections import create_collection, get_collection
from workers.storage.descriptors import store_descriptors
from workers.storage.migrate import migrate
from workers.storage.models import Part, Shape, TrainedModel
from workers.storage.shapes import NewShape, create_shape
from workers.training.examples import Pair
from workers.training.request import TrainingRequest
from workers.training.sources import CreatureSource, Simulation

ZOO = TrainingRequest(collection="zoo", transformations=("noise", "scale"), strengths=(2, 1, 2))
IN_ORDER = TrainingRequest(collection="zoo", correspondence="vertex-order")


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Workbench]:
    """An empty collection "zoo"."""
    bench = small_bench(tmp_path)
    migrate(bench.settings)
    with bench.database.begin() as session:
        create_collection(session, name="zoo", description="", model="heat")
    yield bench
    bench.database.dispose()


def fill(
    bench: Workbench,
    *labels: str | None,
    collection: str = "zoo",
    shuffle: random.Random | None = None,
    ready: bool = True,
) -> None:
    """Rows of shapes that look computed, one a label given; content and name are its place."""
    numbered = list(enumerate(labels))
    if shuffle is not None:
        shuffle.shuffle(numbered)
    with bench.database.begin() as session:
        row = get_collection(session, collection)
        for number, label in numbered:
            digest = sha256(str(number).encode()).hexdigest()
            shape = NewShape(sha256=digest, n_bytes=1, name=f"{number}.off", label=label)
            shape_id, _ = create_shape(session, row.id, shape)
            session.get_one(Shape, shape_id).n_vertices = 100
            if ready:
                store_descriptors(session, row.id, [(shape_id, "heat", b"\0\0\0\0")])


def test_creatures_are_spread_over_every_other_species(bench: Workbench) -> None:
    request = TrainingRequest(transformations=("scale",), strengths=(1,))
    for shapes in (None, 2, 21):
        species = [pair.label for pair in pairs_for(bench, replace(request, shapes=shapes))]
        assert len(set(species)) == len(species) == (shapes or 12)
        assert set(species) <= set(SPECIES[0::2])
    sources = [pair.source for pair in pairs_for(bench, replace(request, shapes=30, seed=7))]
    assert len(set(sources)) == 30
    assert {source.seed for source in sources if isinstance(source, CreatureSource)} == {7, 8}


def test_other_transformations_are_applied_to_poses_where_isometry_is_asked_for(
    bench: Workbench,
) -> None:
    request = TrainingRequest(transformations=("noise",), strengths=(1, 2), shapes=2)
    at_rest = [pair.change for pair in pairs_for(bench, request)]
    assert {change.pose for change in at_rest if isinstance(change, Simulation)} == {None}
    posed = pairs_for(bench, replace(request, transformations=("noise", "isometry")))
    poses = [pair.change.pose for pair in posed if isinstance(pair.change, Simulation)]
    assert None not in poses
    assert len(set(poses)) == len(posed) == 8


def test_the_plan_does_not_depend_on_the_order_of_uploads(bench: Workbench) -> None:
    labels = ["cat", "dog", None, "cat", "dog", "cow", None, "cat"]
    fill(bench, *labels)
    with bench.database.begin() as session:
        create_collection(session, name="other", description="", model="heat")
    fill(bench, *labels, collection="other", shuffle=random.Random(3))
    assert pairs_for(bench, ZOO) == pairs_for(bench, replace(ZOO, collection="other"))
    fewer = pairs_for(bench, replace(ZOO, shapes=4))
    assert fewer == pairs_for(bench, replace(ZOO, collection="other", shapes=4))


def test_shapes_are_spread_evenly_over_labels(bench: Workbench) -> None:
    fill(bench, *["cat"] * 6, *["dog"] * 2, "cow", None, None)
    pairs = pairs_for(bench, replace(ZOO, shapes=8))
    counts = [sum(pair.label == label for pair in pairs) for label in ("cat", "dog", "cow")]
    assert counts == [3 * 4, 2 * 4, 1 * 4]  # two transformations in two strengths
    assert len({pair.label for pair in pairs}) == 5  # a shape without a label is its own class
    assert [pair.number for pair in pairs] == list(range(32))
    assert len({pair.label for pair in pairs_for(bench, replace(ZOO, shapes=2))}) == 2


def test_a_pair_survives_its_payload_and_is_known_by_what_it_is_made_of(bench: Workbench) -> None:
    fill(bench, "cat", "dog")
    pairs = pairs_for(bench, ZOO) + pairs_for(
        bench, TrainingRequest(transformations=("all",), shapes=2)
    )
    assert [Pair.from_payload(pair.to_payload()) for pair in pairs] == pairs
    assert len({pair.key for pair in pairs}) == len(pairs)
    one = pairs[0]
    assert replace(one, number=9, label="x", item="y").key == one.key
    assert replace(one, criterion="kernel").key != one.key


@pytest.mark.parametrize(
    ("request_", "error", "message"),
    [
        (TrainingRequest(), InsufficientTrainingDataError, "isometry, topology, holes"),
        (replace(ZOO, transformations=("melt",)), InvalidRequestError, "'melt'; there are isom"),
        (replace(ZOO, strengths=()), InvalidRequestError, r"expected some of \[1, 2, 3, 4, 5\]"),
        (replace(ZOO, strengths=(1, 6)), InvalidRequestError, r"\[1, 6\]"),
        (replace(ZOO, collection="none"), CollectionNotFoundError, "'none'"),
        (replace(ZOO, correspondence="none"), InvalidRequestError, "simulated, vertex-order"),
        (replace(IN_ORDER, collection=None), InvalidRequestError, "needs a collection"),
        (replace(IN_ORDER, transformations=("scale",)), InvalidRequestError, "each other's"),
        (ZOO, InsufficientTrainingDataError, "3 shapes that are ready, of 1 labels \\('cat'\\)"),
        (IN_ORDER, InsufficientTrainingDataError, "at least 2 labels of at least 2 shapes"),
        (
            TrainingRequest(transformations=("scale",), strengths=(1, 2, 3, 4, 5), shapes=1001),
            InvalidRequestError,
            "5005 pairs",
        ),
    ],
)
def test_what_cannot_be_learned_from_is_refused(
    bench: Workbench, request_: TrainingRequest, error: type[ProteusError], message: str
) -> None:
    fill(bench, "cat", "cat", "cat")
    with pytest.raises(error, match=message):
        pairs_for(bench, request_)


def test_shapes_that_are_still_computed_are_waited_for(bench: Workbench) -> None:
    fill(bench, "cat", "dog", "cow", ready=False)
    with pytest.raises(ShapeNotReadyError, match=r"0\.off and 2 more of collection 'zoo'"):
        pairs_for(bench, ZOO)


def test_shapes_of_a_label_are_paired_in_a_circle_by_name(bench: Workbench) -> None:
    fill(bench, "cat", "dog", "cat", "dog", "cat", None, "cow")
    items = [pair.item for pair in pairs_for(bench, IN_ORDER)]
    cats = ["0.off and 2.off", "2.off and 4.off", "4.off and 0.off"]
    assert items == [*cats, "1.off and 3.off", "3.off and 1.off"]


# -- files that share their vertex order --------------------------------------------------


def store(bench: Workbench, label: str, name: str, mesh: TriangleMesh) -> None:
    """Upload a mesh; its row looks computed by a cleaning that repaired something."""
    data = write(mesh, "off")
    digest = sha256(data).hexdigest()
    bench.blobs.put(mesh_key(digest), data)
    with bench.database.begin() as session:
        row = get_collection(session, "zoo")
        shape = NewShape(sha256=digest, n_bytes=len(data), name=name, label=label)
        shape_id, _ = create_shape(session, row.id, shape)
        found = session.get_one(Shape, shape_id)
        found.n_vertices, found.repairs = 1, ["dropped 1 unreferenced vertex"]
        store_descriptors(session, row.id, [(shape_id, "heat", b"\0\0\0\0")])


def with_spare(mesh: TriangleMesh, count: int) -> TriangleMesh:
    """The mesh behind vertices that no face has."""
    spare = 7.0 + np.arange(3.0 * count).reshape(count, 3)
    return TriangleMesh(np.concatenate([spare, mesh.vertices]), mesh.faces + count)


def stretched(mesh: TriangleMesh, factor: float) -> TriangleMesh:
    return TriangleMesh(mesh.vertices * [factor, 1.0, 1.0], mesh.faces)


def test_files_in_vertex_order_are_each_others_transformations(bench: Workbench) -> None:
    for seed, label in ((1, "bean"), (2, "pea")):
        mesh = bumpy_sphere(3, seed)
        for number in range(2):
            store(bench, label, f"{label}{number}.off", with_spare(stretched(mesh, 1 + number), 2))
    begin_training(bench, "ordered", IN_ORDER)
    assert work(bench) == ["pair"] * 4 + ["fit"]
    report = definition(bench, "ordered")["training"]
    assert (report["n_pairs"], report["classes"]) == (4, ["bean", "pea"])
    assert report["shape_counts"] == {"bean": 2, "pea": 2}


def test_files_of_a_label_with_different_numbers_of_vertices_are_refused(bench: Workbench) -> None:
    for seed, label in ((1, "bean"), (2, "pea")):
        mesh = bumpy_sphere(2, seed)
        store(bench, label, f"{label}-a.off", with_spare(stretched(mesh, 2.0), 1))
        count = 1 if label == "bean" else 2
        store(bench, label, f"{label}-b.off", with_spare(stretched(mesh, 3.0), count))
    message = r"labelled 'pea'.* pea-a\.off has 163 vertices, pea-b\.off has 164"
    with pytest.raises(InvalidRequestError, match=message):
        pairs_for(bench, IN_ORDER)
    with bench.database.read() as session:
        assert session.query(Part).count() == 0
        assert session.query(TrainedModel).filter_by(built_in=False).count() == 0
